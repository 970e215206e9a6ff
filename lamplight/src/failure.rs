//! Why a command did not do what it was told, and the exit status that says so.

use std::{fmt, process::ExitCode};

use files::WriteError;

/// A failure with its exit status.
#[derive(Debug)]
pub(crate) enum Failure {
    /// Bad arguments or a bad scenario: nothing was started. Exit status 2.
    Usage(anyhow::Error),
    /// The run failed, or what it found cannot be written. Exit status 1.
    Run(anyhow::Error),
}

impl From<WriteError> for Failure {
    /// Nothing is wrong with the command.
    fn from(error: WriteError) -> Self {
        Self::run(error)
    }
}

impl Failure {
    pub(crate) fn usage(error: impl Into<anyhow::Error>) -> Self {
        Self::Usage(error.into())
    }

    pub(crate) fn run(error: impl Into<anyhow::Error>) -> Self {
        Self::Run(error.into())
    }

    pub(crate) fn exit_code(&self) -> ExitCode {
        match self {
            Self::Usage(_) => ExitCode::from(2),
            Self::Run(_) => ExitCode::FAILURE,
        }
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Usage(error) | Self::Run(error) => write!(f, "{error:#}"),
        }
    }
}

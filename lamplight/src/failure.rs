//! Why a command did not do what it was told, and the exit status that says so.

use std::fmt;

use files::WriteError;

use crate::status::Status;

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

    pub(crate) fn status(&self) -> Status {
        match self {
            Self::Usage(_) => Status::USAGE,
            Self::Run(_) => Status::FAILURE,
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

//! Why there is no report.

use std::path::Path;

/// Why a folder cannot be reported on.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// The folder is not one of ours.
    #[error(
        "{folder} holds no run, no batch and no paper (looked for metrics.csv, batch.json, paper.json); \
         give the folder that --out named"
    )]
    NotOurs {
        /// The folder as given.
        folder: String,
    },
    /// There is no such folder.
    #[error("{folder} is no folder; give the folder that --out of a run or a batch named")]
    NoFolder {
        /// The folder as given.
        folder: String,
    },
    /// A file that has to be there is not.
    #[error("{file} is missing; {hint}")]
    Missing {
        /// The file.
        file: String,
        /// A way out.
        hint: &'static str,
    },
    /// A page or figure cannot be written.
    #[error(transparent)]
    Unwritten(#[from] files::WriteError),
    /// A file cannot be read, or a folder cannot be made.
    #[error("{file}: {error}")]
    Io {
        /// The file.
        file: String,
        /// The system's error.
        error: std::io::Error,
    },
    /// A file says something that cannot be.
    #[error("{place}: {message}")]
    Bad {
        /// File, and line where there is one.
        place: String,
        /// The problem, and what to do.
        message: String,
    },
    /// A file is in the way that `lamplight report` has not written.
    #[error("{file} was not written by `lamplight report`; move it away")]
    InTheWay {
        /// The file.
        file: String,
    },
}

impl ReportError {
    pub(crate) fn io(path: &Path, error: std::io::Error) -> Self {
        Self::Io { file: path.display().to_string(), error }
    }

    pub(crate) fn bad(place: impl Into<String>, message: impl Into<String>) -> Self {
        Self::Bad { place: place.into(), message: message.into() }
    }
}

//! Why a file could not be written, and what can be done about it.

use std::{
    io::{self, ErrorKind},
    path::{Path, PathBuf},
};

use rustix::process::{Resource, getrlimit};

/// A file that could not be written, or not to its end.
#[derive(Debug, thiserror::Error)]
#[error("cannot write {}: {}", .path.display(), why(.error))]
pub struct WriteError {
    path: PathBuf,
    error: io::Error,
}

impl WriteError {
    /// An `error` of the file at `path`.
    pub fn new(path: &Path, error: io::Error) -> Self {
        Self { path: path.into(), error }
    }

    /// Whether a new file could not be made because there is one of this name.
    pub fn is_already_there(&self) -> bool {
        self.error.kind() == ErrorKind::AlreadyExists
    }
}

/// The reason for a failed write, with the limit that was met and the way out.
pub fn why(error: &io::Error) -> String {
    let hint = match error.kind() {
        ErrorKind::StorageFull => {
            "make room on that file system (`df -h` and `df -i` show what is left), or write elsewhere".into()
        }
        ErrorKind::QuotaExceeded => {
            "make room within your quota (`quota` shows it), or write elsewhere".into()
        }
        ErrorKind::FileTooLarge => match getrlimit(Resource::Fsize).current {
            Some(bytes) => format!(
                "no file may be larger than {bytes} bytes here; `ulimit -f unlimited` lifts that limit"
            ),
            None => "the file system has no room for a file of that size; write elsewhere".into(),
        },
        _ => return error.to_string(),
    };
    format!("{error}; {hint}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_full_disk_is_told_with_its_file_and_the_way_out() {
        // What writing to /dev/full gives.
        let error = WriteError::new(Path::new("out/metrics.csv"), io::Error::from_raw_os_error(28));
        assert_eq!(
            error.to_string(),
            "cannot write out/metrics.csv: No space left on device (os error 28); make room on that file system \
             (`df -h` and `df -i` show what is left), or write elsewhere"
        );
    }
}

//! Journal of a shrink on disk: what it has found out so far, so that one that was cut short can go on.
//!
//! One JSON line per tried candidate: the hash of its scenario and of the question, and the verdict. A last line
//! that a killed process left unfinished is dropped; nothing else is ever changed. Where the disk is full, the search
//! goes on without it.

use std::{
    collections::BTreeMap,
    fs::{self, File, TryLockError},
    io::{self, Read},
    path::{Path, PathBuf},
};

use files::{Lines, WriteError};
use serde::{Deserialize, Serialize};
use twox_hash::XxHash3_128;

/// The verdicts of one shrink.
#[derive(Debug)]
pub(crate) struct Journal {
    lines: Lines,
    /// Whether what is found out from now on is kept.
    is_kept: bool,
    verdicts: BTreeMap<String, bool>,
    /// Holds the lock.
    _file: File,
}

/// Why a journal cannot be used.
#[derive(Debug, thiserror::Error)]
pub(crate) enum JournalError {
    /// Another process holds it.
    #[error("{path} is in use: another `lamplight shrink` writes there; give --out another file", path = .0.display())]
    InUse(PathBuf),
    /// Somebody else has written to it.
    #[error("{path}:{line}: is no verdict of a shrink; remove this file to begin anew", path = .path.display())]
    Foreign { path: PathBuf, line: usize },
    /// It cannot be gone on with.
    #[error(transparent)]
    Unwritten(#[from] WriteError),
    /// The file system said no.
    #[error("cannot keep what is found out in {path}: {error}; give --out a file in another folder", path = .path.display())]
    Io { path: PathBuf, error: io::Error },
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Line {
    candidate: String,
    shows: bool,
}

/// Key of a candidate: another question, or another version of this program, is another key.
pub(crate) fn key(expression: &str, scenario: &str) -> String {
    let text = [env!("CARGO_PKG_VERSION"), expression, scenario].join("\0");
    format!("{:032x}", XxHash3_128::oneshot(text.as_bytes()))
}

impl Journal {
    /// Opens the journal at `path`, or begins it.
    pub(crate) fn open(path: PathBuf) -> Result<Self, JournalError> {
        let failed = |error| JournalError::Io { path: path.clone(), error };
        let mut file = File::options()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .open(&path)
            .map_err(failed)?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => return Err(JournalError::InUse(path)),
            Err(TryLockError::Error(error)) => return Err(failed(error)),
        }
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).map_err(failed)?;
        let whole = bytes.iter().rposition(|&byte| byte == b'\n').map_or(0, |last| last + 1);
        let mut verdicts = BTreeMap::new();
        for (index, line) in bytes[..whole].split_inclusive(|&byte| byte == b'\n').enumerate() {
            let Line { candidate, shows } = serde_json::from_slice(line)
                .map_err(|_| JournalError::Foreign { path: path.clone(), line: index + 1 })?;
            verdicts.insert(candidate, shows);
        }
        let lines = Lines::go_on(&path, whole as u64)?;
        Ok(Self { lines, is_kept: true, verdicts, _file: file })
    }

    /// Where it is.
    pub(crate) fn path(&self) -> &Path {
        self.lines.path()
    }

    /// Number of verdicts.
    pub(crate) fn len(&self) -> usize {
        self.verdicts.len()
    }

    /// Returns the verdict on a candidate, if it is known.
    pub(crate) fn verdict(&self, candidate: &str) -> Option<bool> {
        self.verdicts.get(candidate).copied()
    }

    /// Remembers a verdict, beyond the end of this process if the disk has room.
    pub(crate) fn record(&mut self, candidate: String, shows: bool) {
        let line = Line { candidate, shows };
        let mut text = serde_json::to_string(&line).expect("a verdict is plain data");
        text.push('\n');
        if self.is_kept
            && let Err(error) = self.lines.add(text.as_bytes())
        {
            self.is_kept = false;
            tracing::warn!("{error}; the search goes on, but if it is cut short, it begins anew from here");
        }
        self.verdicts.insert(line.candidate, shows);
    }

    /// Removes it: the shrink is complete.
    pub(crate) fn remove(self) -> Result<(), JournalError> {
        let path = self.path().to_owned();
        fs::remove_file(&path).map_err(|error| JournalError::Io { path, error })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder() -> tempfile::TempDir {
        tempfile::tempdir().unwrap()
    }

    #[test]
    fn verdicts_outlive_the_process_that_found_them() {
        let folder = folder();
        let path = folder.path().join("a.journal");
        let mut journal = Journal::open(path.clone()).unwrap();
        journal.record(key("a > 1", "x"), true);
        journal.record(key("a > 1", "y"), false);
        drop(journal);
        let journal = Journal::open(path.clone()).unwrap();
        assert_eq!(journal.verdict(&key("a > 1", "x")), Some(true));
        assert_eq!(journal.verdict(&key("a > 1", "y")), Some(false));
        assert_eq!(journal.verdict(&key("a > 2", "x")), None);
        journal.remove().unwrap();
        assert!(!path.exists());
    }

    #[test]
    fn a_line_that_a_killed_run_left_broken_is_dropped() {
        let folder = folder();
        let path = folder.path().join("a.journal");
        let mut journal = Journal::open(path.clone()).unwrap();
        journal.record("1".into(), true);
        drop(journal);
        let whole = fs::read(&path).unwrap();
        fs::write(&path, [&whole[..], b"{\"candidate\":\"2\",\"sho"].concat()).unwrap();
        let mut journal = Journal::open(path.clone()).unwrap();
        assert_eq!(journal.len(), 1);
        journal.record("3".into(), false);
        drop(journal);
        let journal = Journal::open(path).unwrap();
        assert_eq!((journal.verdict("1"), journal.verdict("3")), (Some(true), Some(false)));
    }

    #[test]
    fn what_is_no_journal_is_left_alone() {
        let folder = folder();
        let path = folder.path().join("a.journal");
        fs::write(&path, "{\"candidate\":\"1\",\"shows\":true}\nprecious\n").unwrap();
        let error = Journal::open(path.clone()).unwrap_err().to_string();
        assert!(
            error.ends_with("a.journal:2: is no verdict of a shrink; remove this file to begin anew"),
            "{error}"
        );
        assert!(fs::read_to_string(path).unwrap().ends_with("precious\n"));
    }

    #[test]
    fn two_shrinks_do_not_share_a_journal() {
        let folder = folder();
        let path = folder.path().join("a.journal");
        let _first = Journal::open(path.clone()).unwrap();
        assert!(matches!(Journal::open(path), Err(JournalError::InUse(_))));
    }
}

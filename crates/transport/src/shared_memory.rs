//! `/dev/shm`, where POSIX shared memory lives on Linux: whether it can be used, and what is left of it.

use std::{fmt::Display, io};

use rustix::fs::{Access, StatFs, access, statfs};

/// Where it is; a tmpfs, as a rule.
pub(crate) const PATH: &str = "/dev/shm";

/// How to have more bytes there.
pub const MORE_BYTES: &str = "`lamplight clean` removes what crashed runs left; or enlarge it: \
                              sudo mount -o remount,size=90% /dev/shm";
/// How to have more inodes there.
pub const MORE_FILES: &str = "`lamplight clean` removes what crashed runs left; or allow more: \
                              sudo mount -o remount,nr_inodes=1000000 /dev/shm";

/// Fewer inodes than this do for no robot: what has failed with so few has failed for want of them.
const FILES_FEW: u64 = 24;
/// The same in bytes.
const BYTES_FEW: u64 = 128 * 1024;

/// Room left there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SharedMemory {
    /// Bytes. `None` if there is no bound.
    pub bytes: Option<u64>,
    /// Inodes: so many files and folders can be made. `None` if there is no bound.
    pub files: Option<u64>,
}

/// Why no run of processes is possible there.
#[derive(Debug, thiserror::Error)]
pub enum SharedMemoryError {
    /// It is not there, or may not be looked at.
    #[error(
        "{PATH}: {0}; processes share memory there\n\
         hint: sudo mkdir -p {PATH} && sudo mount -t tmpfs -o mode=1777 tmpfs {PATH}"
    )]
    Missing(io::Error),
    /// Nothing can be made there.
    #[error(
        "{PATH} cannot be written to: {0}\n\
         hint: sudo mount -o remount,rw,mode=1777 {PATH}"
    )]
    NotWritable(io::Error),
}

impl SharedMemory {
    /// As it is now.
    ///
    /// # Errors
    /// If no run of processes is possible there.
    pub fn look() -> Result<Self, SharedMemoryError> {
        let stat = statfs(PATH).map_err(|error| SharedMemoryError::Missing(error.into()))?;
        let all = Access::READ_OK | Access::WRITE_OK | Access::EXEC_OK;
        access(PATH, all).map_err(|error| SharedMemoryError::NotWritable(error.into()))?;
        Ok(Self::of(&stat))
    }

    fn of(stat: &StatFs) -> Self {
        // A tmpfs without a bound tells of none at all.
        let files = (stat.f_files > 0).then_some(stat.f_ffree);
        let bytes = (stat.f_blocks > 0).then_some(stat.f_bavail * stat.f_bsize as u64);
        Self { bytes, files }
    }

    /// The resource there is too little of, in words that go on after a colon.
    fn lack(self) -> Option<String> {
        match self {
            Self { files: Some(files), .. } if files < FILES_FEW => {
                Some(format!("{PATH} has {files} inodes left; {MORE_FILES}"))
            }
            Self { bytes: Some(bytes), .. } if bytes < BYTES_FEW => {
                Some(format!("{PATH} has {bytes} bytes left; {MORE_BYTES}"))
            }
            Self { .. } => None,
        }
    }
}

/// `reason` why something could not be made there; and that it is full, if so: what says `reason` may not know.
pub fn explained(reason: impl Display) -> String {
    match SharedMemory::look().map(SharedMemory::lack) {
        Ok(None) => reason.to_string(),
        Ok(Some(lack)) => format!("{reason}: {lack}"),
        Err(error) => format!("{reason}: {error}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lack_is_named_with_its_remedy() {
        let plenty = SharedMemory { bytes: Some(1 << 30), files: Some(1000) };
        assert_eq!(plenty.lack(), None);
        assert_eq!(SharedMemory { bytes: None, files: None }.lack(), None, "there is no bound");
        let lack = SharedMemory { files: Some(3), ..plenty }.lack().unwrap();
        assert!(lack.starts_with("/dev/shm has 3 inodes left; ") && lack.contains("nr_inodes"), "{lack}");
        let lack = SharedMemory { bytes: Some(4096), ..plenty }.lack().unwrap();
        assert!(lack.starts_with("/dev/shm has 4096 bytes left; ") && lack.contains("size="), "{lack}");
    }

    #[test]
    fn what_fails_while_there_is_enough_is_explained_by_its_own_reason() {
        assert_eq!(explained("AlreadyExists"), "AlreadyExists");
    }
}

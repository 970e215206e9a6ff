//! Room on a disk, kept for what comes last and counts most.

use std::{fs::File, io, path::Path};

use rustix::fs::{FallocateFlags, fallocate};

/// Room in a file without a name, which is free again once this is dropped, or its process has ended.
#[derive(Debug)]
pub struct Reserve {
    _file: File,
}

impl Reserve {
    /// Keeps room for so many `bytes` on the disk of `folder`.
    ///
    /// # Errors
    /// If there is not so much room, or the file system does not keep any.
    pub fn in_folder(folder: &Path, bytes: u64) -> io::Result<Self> {
        let file = tempfile::tempfile_in(folder)?;
        fallocate(&file, FallocateFlags::empty(), 0, bytes)?;
        Ok(Self { _file: file })
    }
}

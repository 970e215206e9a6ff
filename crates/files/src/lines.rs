//! A file that grows by whole lines.

use std::{
    fs::{File, OpenOptions},
    io::{self, ErrorKind, Seek, SeekFrom, Write},
    path::{Path, PathBuf},
};

use crate::WriteError;

/// A file of lines that ends with a whole one, also when the disk is full: the first write that fails takes what it
/// has begun back with it, and nothing is written after it. A file with holes would deceive.
///
/// Writers that keep a part of a line back, such as `csv::Writer`, may write through it.
#[derive(Debug)]
pub struct Lines {
    path: PathBuf,
    file: File,
    length: u64,
    /// Where the last whole line ends.
    whole: u64,
    is_broken: bool,
}

impl Lines {
    /// Begins the file at `path` anew.
    ///
    /// # Errors
    /// If it cannot be made.
    pub fn create(path: &Path) -> Result<Self, WriteError> {
        let file = File::create(path).map_err(|error| WriteError::new(path, error))?;
        Ok(Self { path: path.into(), file, length: 0, whole: 0, is_broken: false })
    }

    /// Goes on with the file at `path`, which is made if it is not there, after its first `length` bytes, which are
    /// whole lines; the rest is dropped.
    ///
    /// # Errors
    /// If it cannot be opened or cut.
    pub fn go_on(path: &Path, length: u64) -> Result<Self, WriteError> {
        let open = || {
            let mut file = OpenOptions::new().write(true).create(true).truncate(false).open(path)?;
            if file.metadata()?.len() != length {
                file.set_len(length)?;
            }
            file.seek(SeekFrom::Start(length))?;
            Ok(file)
        };
        let file = open().map_err(|error| WriteError::new(path, error))?;
        Ok(Self { path: path.into(), file, length, whole: length, is_broken: false })
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Adds whole lines.
    ///
    /// # Errors
    /// If they cannot all be written. Those that can be are there.
    pub fn add(&mut self, lines: &[u8]) -> Result<(), WriteError> {
        self.write_all(lines).map_err(|error| WriteError::new(&self.path, error))
    }
}

impl Write for Lines {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.is_broken {
            return Err(io::Error::other("it ends where an earlier line could not be written"));
        }
        match self.file.write(bytes) {
            Ok(written) => {
                if let Some(last) = bytes[..written].iter().rposition(|&byte| byte == b'\n') {
                    self.whole = self.length + last as u64 + 1;
                }
                self.length += written as u64;
                Ok(written)
            }
            Err(error) if error.kind() == ErrorKind::Interrupted => Err(error),
            Err(error) => {
                self.is_broken = true;
                // Where not even this can be done, the reader of the error knows of the file.
                let _ = self.file.set_len(self.whole);
                Err(error)
            }
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn a_file_is_gone_on_with_where_its_lines_are_whole() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("lines");
        Lines::create(&path).unwrap().add(b"one\ntwo\nthr").unwrap();
        Lines::go_on(&path, 8).unwrap().add(b"three\n").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"one\ntwo\nthree\n");
    }

    #[test]
    fn nothing_follows_a_line_that_could_not_be_written() {
        let full = Path::new("/dev/full");
        let mut lines = Lines::create(full).unwrap();
        let error = lines.add(b"one\n").unwrap_err().to_string();
        assert!(error.starts_with("cannot write /dev/full: No space left on device"), "{error}");
        let error = lines.add(b"two\n").unwrap_err().to_string();
        assert!(error.ends_with("an earlier line could not be written"), "{error}");
    }
}

//! A folder that is filled whole or not at all.

use std::{
    fs::{self, File},
    io::{self, ErrorKind},
    path::{Path, PathBuf},
};

use anyhow::anyhow;
use files::WriteError;

use crate::failure::Failure;

/// A folder that was empty. Unless it is [kept](NewFolder::keep), what was put into it is removed with its value, and so is what
/// was made to have it.
#[derive(Debug)]
pub(super) struct NewFolder {
    path: PathBuf,
    name: String,
    /// Files that were put into it.
    files: Vec<PathBuf>,
    /// Folders that were not there before, innermost first.
    made: Vec<PathBuf>,
    is_kept: bool,
}

impl NewFolder {
    /// Makes the folder at `path`, or takes it as it is if it is empty.
    ///
    /// # Errors
    /// If it is not empty, no folder, or cannot be made.
    pub(super) fn claim(path: &Path) -> Result<Self, Failure> {
        let missing = path.ancestors().filter(|it| !it.as_os_str().is_empty()).take_while(|it| !it.exists());
        let mut folder = Self {
            path: path.into(),
            name: String::new(),
            files: Vec::new(),
            made: missing.map(Into::into).collect(),
            is_kept: false,
        };
        let named = |what: &str| Failure::Usage(anyhow!("{} {what}", path.display()));
        if path.exists() && !path.is_dir() {
            return Err(named("is a file; name a folder that is empty or not there yet"));
        }
        let failed = |error: io::Error| Failure::from(WriteError::new(path, error));
        fs::create_dir_all(path).map_err(failed)?;
        if fs::read_dir(path).map_err(failed)?.next().is_some() {
            return Err(named("is not empty; name a folder that is empty or not there yet"));
        }
        // Of `.` too.
        let whole = path.canonicalize().map_err(failed)?;
        folder.name = whole.file_name().map_or("bag".into(), |name| name.to_string_lossy().into_owned());
        Ok(folder)
    }

    /// The last part of its path.
    pub(super) fn name(&self) -> &str {
        &self.name
    }

    /// Begins a file, under another name until it [ends](NewFolder::end_file). Returns the path that it will have.
    pub(super) fn begin_file(&mut self, name: &str) -> Result<(PathBuf, File), WriteError> {
        let path = self.path.join(name);
        let draft = files::draft_of(&path);
        let file = File::create_new(&draft).map_err(|error| WriteError::new(&draft, error))?;
        self.files.push(draft);
        Ok((path, file))
    }

    /// Gives a file that is whole its name.
    pub(super) fn end_file(&mut self, path: &Path) -> Result<(), WriteError> {
        fs::rename(files::draft_of(path), path).map_err(|error| WriteError::new(path, error))?;
        self.files.push(path.into());
        Ok(())
    }

    /// Writes a whole file.
    pub(super) fn write(&mut self, name: &str, text: &str) -> Result<(), WriteError> {
        let path = self.path.join(name);
        files::create(&path, text)?;
        self.files.push(path);
        Ok(())
    }

    /// Leaves it as it is now.
    pub(super) fn keep(mut self) {
        self.is_kept = true;
    }
}

impl Drop for NewFolder {
    fn drop(&mut self) {
        if self.is_kept {
            return;
        }
        for file in &self.files {
            if let Err(error) = fs::remove_file(file)
                && error.kind() != ErrorKind::NotFound
            {
                tracing::warn!("{} is left: {error}", file.display());
            }
        }
        // Those that somebody else has put something into stay.
        for folder in &self.made {
            let _ = fs::remove_dir(folder);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_kept_leaves_no_trace() {
        let base = tempfile::tempdir().unwrap();
        let path = base.path().join("a/b");
        let mut folder = NewFolder::claim(&path).unwrap();
        assert_eq!(folder.name(), "b");
        let (whole, _) = folder.begin_file("whole").unwrap();
        folder.end_file(&whole).unwrap();
        folder.begin_file("begun").unwrap();
        folder.write("text", "text").unwrap();
        assert_eq!(fs::read_dir(&path).unwrap().count(), 3);
        drop(folder);
        assert_eq!(fs::read_dir(base.path()).unwrap().count(), 0);
        // One that was there stays.
        let mut folder = NewFolder::claim(base.path()).unwrap();
        folder.write("text", "text").unwrap();
        drop(folder);
        assert_eq!(fs::read_dir(base.path()).unwrap().count(), 0);
    }

    #[test]
    fn what_is_there_is_refused_and_left_alone() {
        let base = tempfile::tempdir().unwrap();
        let file = base.path().join("file");
        fs::write(&file, "mine").unwrap();
        for (path, what) in [(base.path(), "is not empty"), (&file, "is a file")] {
            let error = NewFolder::claim(path).unwrap_err().to_string();
            assert!(error.contains(what) && error.contains(&*path.to_string_lossy()), "{error}");
        }
        assert_eq!(fs::read_to_string(&file).unwrap(), "mine");
    }
}

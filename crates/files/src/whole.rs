//! Files that are written whole or not at all.

use std::{
    fs::{self, File},
    io::Write,
    path::{Path, PathBuf},
};

use crate::WriteError;

/// Where [`replace`] writes the file at `path` first. A process that is killed there leaves it.
pub fn draft_of(path: &Path) -> PathBuf {
    let mut draft = path.as_os_str().to_owned();
    draft.push(".draft");
    draft.into()
}

/// Writes `bytes` to `path`; what was there stays until all of it is written.
///
/// # Errors
/// If it cannot be written. Then what was there is there still.
pub fn replace(path: &Path, bytes: impl AsRef<[u8]>) -> Result<(), WriteError> {
    let draft = draft_of(path);
    let written = fs::write(&draft, bytes).and_then(|()| fs::rename(&draft, path));
    written.map_err(|error| {
        // Where there was no room for all of it, a part would only take room.
        let _ = fs::remove_file(&draft);
        WriteError::new(path, error)
    })
}

/// Writes `bytes` to a new file at `path`.
///
/// # Errors
/// If there is a file of this name, which is left alone, or it cannot be written. Then nothing is left that would be
/// in the way of the next attempt.
pub fn create(path: &Path, bytes: impl AsRef<[u8]>) -> Result<(), WriteError> {
    let mut file = File::create_new(path).map_err(|error| WriteError::new(path, error))?;
    file.write_all(bytes.as_ref()).map_err(|error| {
        // It was made a moment ago, and by us.
        let _ = fs::remove_file(path);
        WriteError::new(path, error)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_new_file_is_in_nobodys_way_and_nobody_in_its() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("new");
        create(&path, "mine").unwrap();
        assert!(create(&path, "another").unwrap_err().is_already_there());
        assert_eq!(fs::read_to_string(&path).unwrap(), "mine");
        replace(&path, "yours").unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "yours");
        assert!(!draft_of(&path).exists());
    }
}

//! A path as serde writes and reads it whatever its bytes: by itself serde refuses one that is not UTF-8.
//! For `#[serde(with = "files::os_path")]`.

use std::{ffi::OsString, path::PathBuf};

use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Writes `path` as the operating system's string.
///
/// # Errors
/// Those of `serializer`.
pub fn serialize<S: Serializer>(path: &Option<PathBuf>, serializer: S) -> Result<S::Ok, S::Error> {
    path.as_ref().map(|path| path.as_os_str()).serialize(serializer)
}

/// Reads what [`serialize`] has written.
///
/// # Errors
/// Those of `deserializer`, or if it holds something else.
pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<PathBuf>, D::Error> {
    Ok(Option::<OsString>::deserialize(deserializer)?.map(PathBuf::from))
}

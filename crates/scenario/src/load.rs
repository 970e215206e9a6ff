//! Reading a scenario from disk: the only I/O of this crate.

use std::fs::{self, File};
use std::io::{self, ErrorKind, Read};
use std::path::Path;

use super::error::{Place, ScenarioError};
use super::overrides::Override;
use super::scenario::Scenario;

/// Largest scenario, bytes: room for the places and headings of [`MAX_ROBOTS`](super::MAX_ROBOTS) robots with every
/// digit. A pipe or a device may have no end.
pub const BYTES_MAX: u64 = 128 << 20;

/// From this similarity (Jaro-Winkler, 0 to 1) on, a file may be the one that was meant.
const SIMILAR: f64 = 0.75;

impl Scenario {
    /// The scenario in a file, with overrides.
    pub fn load(path: &Path, overrides: &[Override]) -> Result<Self, ScenarioError> {
        Self::parse(&path.display().to_string(), &Self::text_of(path)?, overrides)
    }

    /// The text of a file, for several scenarios that differ by their overrides.
    pub fn text_of(path: &Path) -> Result<String, ScenarioError> {
        read(path).map_err(|(message, hint)| ScenarioError {
            place: Place::File(path.display().to_string()),
            message,
            hint,
        })
    }
}

/// The text of a file, or what is wrong with it and a hint.
fn read(path: &Path) -> Result<String, (String, Option<String>)> {
    if path.extension().is_some_and(|extension| extension == "py") {
        let hint = format!("name a scenario, and this one by --controller {}", path.display());
        return Err(("is a file of Python, not a scenario".into(), Some(hint)));
    }
    let bytes = bytes(path).map_err(|error| match error.kind() {
        ErrorKind::NotFound => ("no such file".into(), similar_files(path)),
        ErrorKind::IsADirectory => ("is a directory, not a scenario file".into(), None),
        _ => (format!("cannot be read: {error}"), None),
    })?;
    if bytes.len() as u64 > BYTES_MAX {
        return Err((format!("is longer than {BYTES_MAX} bytes, the most that a scenario may have"), None));
    }
    String::from_utf8(bytes).map_err(|error| {
        let line =
            1 + error.as_bytes()[..error.utf8_error().valid_up_to()].iter().filter(|b| **b == b'\n').count();
        (format!("is not UTF-8 text (line {line})"), None)
    })
}

/// The bytes of a file, at most one more than a scenario may have.
fn bytes(path: &Path) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    File::open(path)?.take(BYTES_MAX + 1).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// The `.toml` files beside a missing one whose names resemble it.
fn similar_files(missing: &Path) -> Option<String> {
    let folder = missing.parent()?;
    let wanted = missing.file_stem()?.to_string_lossy();
    let listed = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let mut similar: Vec<_> = fs::read_dir(listed)
        .ok()?
        .filter_map(|entry| Some(folder.join(entry.ok()?.file_name())))
        .filter(|path| path.extension().is_some_and(|extension| extension == "toml"))
        .filter(|path| {
            path.file_stem()
                .is_some_and(|stem| strsim::jaro_winkler(&wanted, &stem.to_string_lossy()) >= SIMILAR)
        })
        .map(|path| path.display().to_string())
        .collect();
    similar.sort();
    (!similar.is_empty()).then(|| format!("did you mean {}?", similar.join(" or ")))
}

//! Readers for runs and batches: the scenario as it was resolved, JSON with a place in its errors.

use std::{fs, io::ErrorKind, path::Path};

use scenario::{Scenario, ScenarioError};
use serde::de::DeserializeOwned;

use crate::error::ReportError;

/// The scenario of a folder.
pub fn scenario(folder: &Path) -> Result<Scenario, ReportError> {
    let path = folder.join("scenario.toml");
    if !path.is_file() {
        return Err(ReportError::Missing {
            file: path.display().to_string(),
            hint: "a run and a batch write it first; this folder is not whole",
        });
    }
    Scenario::load(&path, &[]).map_err(|error: ScenarioError| {
        ReportError::bad(
            error.place.to_string(),
            format!("{}; as a run writes it, it is sound", error.message),
        )
    })
}

/// A JSON file; `None` if there is none.
pub fn json<T: DeserializeOwned>(path: &Path) -> Result<Option<T>, ReportError> {
    let text = match fs::read_to_string(path) {
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
        other => other.map_err(|error| ReportError::io(path, error))?,
    };
    serde_json::from_str(&text)
        .map(Some)
        .map_err(|error| ReportError::bad(format!("{}:{}", path.display(), error.line()), error.to_string()))
}

//! An override: `key.path=value` from the command line, stronger than the file.
//!
//! The value is a TOML value, or else a bare string (`channel.model=voronoi`). An index steps into an array
//! (`field.gaussian.0.sigma_m=0.2`), a `*` into each of its entries (`field.gaussian.*.sigma_m=0.2`). Nothing after the
//! `=` removes the key (`channel.range_m=`). One of a kind of its own ([`Override::controller`]) adds an entry to `[[controller]]`.

use std::path;
use std::str::FromStr;

/// One `key.path=value`, and how the user spelled it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Override {
    path: String,
    value: String,
    spelling: String,
    /// The value is one more entry of the array at the path.
    appends: bool,
}

/// Why a text is not an override.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum OverrideError {
    /// No `=` in it.
    #[error("expected key.path=value, got `{0}`")]
    NoEquals(String),
    /// A controller's file has no path that is text.
    #[error(
        "--controller {0}: expected FILE.py:CLASS or FILE.py:CLASS=ROBOTS, with a path that is UTF-8 text"
    )]
    NoPath(String),
    /// A key of the path is empty.
    #[error("`{0}` has an empty key")]
    EmptyKey(String),
}

impl Override {
    /// Gives robots a controller in Python, such as `my.py:ToTheLight=40-49`; without robots, all of them. A relative path
    /// is relative to the folder that this program is in.
    ///
    /// # Errors
    /// If its path is no text.
    pub fn controller(text: &str) -> Result<Self, OverrideError> {
        // An equals sign in the name of a folder has a slash behind it.
        let (python, robots) = match text.rsplit_once('=').filter(|(_, robots)| !robots.contains('/')) {
            Some((python, robots)) => (python, Some(robots)),
            None => (text, None),
        };
        let absolute = path::absolute(python).ok().and_then(|path| path.into_os_string().into_string().ok());
        let python = absolute.ok_or_else(|| OverrideError::NoPath(text.into()))?;
        let entry = |key: &str, value: &str| (key.to_owned(), toml::Value::String(value.to_owned()));
        let robots = robots.map(|robots| entry("robots", robots));
        let table: toml::Table = [entry("python", &python)].into_iter().chain(robots.clone()).collect();
        Ok(Self {
            path: "controller".into(),
            value: toml::Value::Table(table).to_string(),
            spelling: format!("--controller {text}"),
            appends: robots.is_some(),
        })
    }

    /// The same override under the name of a flag of its own (`--robots 20`), which errors then show.
    pub fn spelled(self, spelling: impl Into<String>) -> Self {
        Self { spelling: spelling.into(), ..self }
    }

    /// How the user spelled it.
    pub fn spelling(&self) -> &str {
        &self.spelling
    }

    /// The keys and indices before the `=`, joined by dots.
    pub(super) fn path(&self) -> &str {
        &self.path
    }

    /// Whether the value is one more entry of the array at the path, rather than in place of what is there.
    pub(super) fn appends(&self) -> bool {
        self.appends
    }

    /// The text after the `=`.
    pub(super) fn value(&self) -> &str {
        &self.value
    }
}

impl FromStr for Override {
    type Err = OverrideError;

    fn from_str(text: &str) -> Result<Self, OverrideError> {
        let (path, value) = text.split_once('=').ok_or_else(|| OverrideError::NoEquals(text.into()))?;
        let (path, value) = (path.trim(), value.trim());
        if path.split('.').any(str::is_empty) {
            return Err(OverrideError::EmptyKey(text.into()));
        }
        let spelling = format!("--set {path}={value}");
        Ok(Self { path: path.into(), value: value.into(), spelling, appends: false })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_override_is_split_at_its_first_equals_sign() {
        let entry: Override = " field.gaussian.0 = { sigma_m = 1 } ".parse().expect("an override");
        assert_eq!((entry.path(), entry.value()), ("field.gaussian.0", "{ sigma_m = 1 }"));
        assert_eq!(entry.spelling(), "--set field.gaussian.0={ sigma_m = 1 }");
    }

    #[test]
    fn an_override_needs_an_equals_sign_and_no_empty_key() {
        let error = |text: &str| text.parse::<Override>().expect_err("not an override").to_string();
        assert_eq!(error("seed"), "expected key.path=value, got `seed`");
        assert_eq!(error("robots..count=1"), "`robots..count=1` has an empty key");
        assert_eq!(error("=1"), "`=1` has an empty key");
    }
}

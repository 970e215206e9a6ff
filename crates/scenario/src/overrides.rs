//! An override: `key.path=value` from the command line, stronger than the file.
//!
//! The value is a TOML value, or else a bare string (`channel.model=voronoi`). An index steps into an array
//! (`field.gaussian.0.sigma_m=0.2`), a `*` into each of its entries (`field.gaussian.*.sigma_m=0.2`). Nothing after the
//! `=` removes the key (`channel.range_m=`).

use std::str::FromStr;

/// One `key.path=value`, and how the user spelled it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Override {
    path: String,
    value: String,
    spelling: String,
}

/// Why a text is not an override.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum OverrideError {
    /// No `=` in it.
    #[error("expected key.path=value, got `{0}`")]
    NoEquals(String),
    /// A key of the path is empty.
    #[error("`{0}` has an empty key")]
    EmptyKey(String),
}

impl Override {
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
        Ok(Self { path: path.into(), value: value.into(), spelling: format!("--set {path}={value}") })
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

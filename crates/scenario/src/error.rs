//! Errors of a scenario, and where: one line for a person, perhaps a second one with a hint.

use std::fmt;

/// Where a scenario is wrong.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Place {
    /// Somewhere in the file, or the file itself.
    File(String),
    /// At a line of the file, counted from 1.
    Line(String, usize),
    /// In an override, as the user spelled it.
    Override(String),
}

/// Where something of a scenario was written: no part of what it means, so all origins are equal.
#[derive(Clone, Debug, Default)]
pub struct Origin(pub Option<Place>);

impl PartialEq for Origin {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

/// Why a scenario cannot be used.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ScenarioError {
    /// Where it is wrong.
    pub place: Place,
    /// The problem, in one line.
    pub message: String,
    /// A way out, if one is known.
    pub hint: Option<String>,
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File(file) => f.write_str(file),
            Self::Line(file, line) => write!(f, "{file}:{line}"),
            Self::Override(spelling) => f.write_str(spelling),
        }
    }
}

impl fmt::Display for ScenarioError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.place, self.message)?;
        self.hint.iter().try_for_each(|hint| write!(f, "\nhint: {hint}"))
    }
}

impl std::error::Error for ScenarioError {}

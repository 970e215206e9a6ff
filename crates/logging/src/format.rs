//! Formats of lines: text for people, JSON for programs.

use std::{
    env,
    fmt::{self, Display},
    str::FromStr,
};

/// The environment variable by which a supervisor tells its children the format: `text` or `json`.
pub const FORMAT_VARIABLE: &str = "LAMPLIGHT_LOG";

/// How lines are written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Format {
    /// For people: ` WARN robot 3 tick 120: percept refused: ...`
    #[default]
    Text,
    /// For programs: an object per line, with the same keys whoever writes it
    Json,
}

impl Format {
    /// All there are, as the command line spells them.
    pub const NAMES: [&'static str; 2] = ["text", "json"];

    /// The format that [`FORMAT_VARIABLE`] names; text if it names none.
    ///
    /// # Errors
    /// If it says something else.
    pub fn from_env() -> Result<Self, UnknownFormat> {
        said(FORMAT_VARIABLE).map_or(Ok(Self::default()), |name| name.parse())
    }
}

impl Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Text => "text",
            Self::Json => "json",
        })
    }
}

/// A format that is none.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnknownFormat(String);

impl Display for UnknownFormat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "`{}` is no log format; there are text and json", self.0)
    }
}

impl std::error::Error for UnknownFormat {}

impl FromStr for Format {
    type Err = UnknownFormat;

    fn from_str(name: &str) -> Result<Self, UnknownFormat> {
        match name {
            "text" => Ok(Self::Text),
            "json" => Ok(Self::Json),
            _ => Err(UnknownFormat(name.into())),
        }
    }
}

/// The value of a variable of the environment, with replacement characters for what is no Unicode.
pub(crate) fn said(variable: &str) -> Option<String> {
    env::var_os(variable).map(|text| text.to_string_lossy().into_owned())
}

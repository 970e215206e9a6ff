//! A problem with values that are each well-formed, before anybody knows in which line they stand.

/// A problem with values that are well-formed by themselves.
#[derive(Debug)]
pub struct Problem {
    /// Paths of the values that disagree; the error points at the first that an override set, else the first.
    pub(super) paths: Vec<String>,
    /// The problem, in one line.
    pub(super) message: String,
    /// A way out, if one is known.
    pub(super) hint: Option<String>,
}

impl Problem {
    /// The same problem with a way out.
    pub(super) fn hint(self, hint: impl Into<String>) -> Self {
        Self { hint: Some(hint.into()), ..self }
    }
}

/// A problem of the values at these paths.
pub(super) fn problem(paths: &[&str], message: impl Into<String>) -> Problem {
    Problem {
        paths: paths.iter().map(|path| path.to_string()).collect(),
        message: message.into(),
        hint: None,
    }
}

/// Nothing if it holds, else the problem.
pub(super) fn ensure(holds: bool, problem: impl FnOnce() -> Problem) -> Result<(), Problem> {
    if holds { Ok(()) } else { Err(problem()) }
}

//! The result of a run, by either engine.

/// Result of a run.
pub(crate) struct Outcome {
    /// Its `summary.json`; `None` if a second signal ended it at once.
    pub(crate) summary: Option<String>,
    /// The signal that cut it short, if one did.
    pub(crate) signal: Option<i32>,
}

//! The result of a run, by either engine.

use engine::summary::Summary;

/// Result of a run.
pub(crate) struct Outcome {
    /// Its summary; `None` of trials, or if a second signal ended it at once.
    pub(crate) summary: Option<Summary>,
    /// The signal that cut it short, if one did.
    pub(crate) signal: Option<i32>,
}

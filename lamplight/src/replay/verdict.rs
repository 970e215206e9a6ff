//! Outcome of comparing a recording with a run.

use protocol::percept::Tick;

/// How often the live line is brought up to date, ticks.
pub(super) const SHOW_EVERY: Tick = 100;

/// Outcome of a comparison.
pub(super) enum Verdict {
    Same(String),
    Different(String),
}

//! The wish to end a run early, from a signal or a supervisor.

use std::sync::{
    Arc,
    atomic::{AtomicI32, Ordering},
};

/// Raised once, seen by everyone who holds a clone.
#[derive(Clone, Debug, Default)]
pub struct StopFlag(Arc<AtomicI32>);

impl StopFlag {
    /// Asks the run to end at its next tick, in the name of `signal`.
    pub fn raise(&self, signal: i32) {
        self.0.store(signal, Ordering::Relaxed);
    }

    /// Whether somebody asked.
    pub fn is_raised(&self) -> bool {
        self.signal().is_some()
    }

    /// By which signal somebody asked.
    pub fn signal(&self) -> Option<i32> {
        Some(self.0.load(Ordering::Relaxed)).filter(|&signal| signal != 0)
    }
}

//! How fast virtual time may pass.

use std::{
    thread,
    time::{Duration, Instant},
};

/// Longest nap, so that a wish to stop is heard.
const NAP: Duration = Duration::from_millis(100);
/// A delay up to this is made up for; a longer one, as after the whole run was stopped, is not:
/// robots on their own timers could not follow a burst of ticks.
const CATCH_UP_MAX: Duration = Duration::from_millis(500);

/// Holds virtual time back to a multiple of real time.
#[derive(Clone, Copy, Debug)]
pub struct Pace {
    /// When the next tick is due.
    due: Instant,
    /// Virtual seconds per real second; `None` for "as fast as it can".
    factor: Option<f64>,
}

impl Pace {
    /// Begins now.
    pub fn new(factor: Option<f64>) -> Self {
        Self { due: Instant::now(), factor }
    }

    /// Sleeps until `step_s` of virtual time may have passed since the last call, or `give_up`
    /// says not to.
    pub fn wait(&mut self, step_s: f64, give_up: impl Fn() -> bool) {
        let Some(factor) = self.factor else { return };
        let period = Duration::try_from_secs_f64(step_s / factor).unwrap_or(Duration::MAX);
        let oldest = Instant::now().checked_sub(CATCH_UP_MAX).unwrap_or(self.due);
        self.due = self.due.checked_add(period).unwrap_or(self.due).max(oldest);
        while !give_up() {
            let left = self.due.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return;
            }
            thread::sleep(left.min(NAP));
        }
    }
}

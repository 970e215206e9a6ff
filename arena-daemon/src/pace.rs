//! How fast virtual time may pass.

use std::{
    thread,
    time::{Duration, Instant},
};

/// Longest nap, so that a wish to stop is heard.
const NAP: Duration = Duration::from_millis(100);

/// Holds virtual time back to a multiple of real time.
#[derive(Clone, Copy, Debug)]
pub struct Pace {
    started: Instant,
    /// Virtual seconds per real second; infinite for "as fast as it can".
    factor: f64,
}

impl Pace {
    /// Begins now. `None` means no cap.
    pub fn new(factor: Option<f64>) -> Self {
        Self { started: Instant::now(), factor: factor.unwrap_or(f64::INFINITY) }
    }

    /// Sleeps until virtual time `time_s` is due, or `give_up` says not to.
    pub fn wait_until(&self, time_s: f64, give_up: impl Fn() -> bool) {
        let due = Duration::try_from_secs_f64(time_s / self.factor).unwrap_or(Duration::ZERO);
        while !give_up() {
            let left = due.saturating_sub(self.started.elapsed());
            if left.is_zero() {
                return;
            }
            thread::sleep(left.min(NAP));
        }
    }
}

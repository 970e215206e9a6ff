//! How fast a run has gone in the last moments.

use std::{
    collections::VecDeque,
    time::{Duration, Instant},
};

/// Rates are over the last so much of wall time.
const OVER: Duration = Duration::from_secs(2);

/// Where a run stood, and when.
#[derive(Clone, Copy, Debug)]
struct Mark {
    at: Instant,
    tick: u64,
    time_s: f64,
}

/// The marks of the last moments, oldest first.
#[derive(Debug, Default)]
pub(super) struct Rates(VecDeque<Mark>);

/// How fast a run goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Rate {
    /// Ticks per second of wall time.
    pub(super) ticks_per_s: f64,
    /// Virtual over wall time.
    pub(super) real_time_factor: f64,
}

impl Rates {
    /// The run stood there.
    pub(super) fn note(&mut self, at: Instant, tick: u64, time_s: f64) {
        self.0.push_back(Mark { at, tick, time_s });
        while self.0.len() > 2 && at.saturating_duration_since(self.0[1].at) >= OVER {
            self.0.pop_front();
        }
    }

    /// How fast it has gone since the oldest mark; `None` if there is but one.
    pub(super) fn rate(&self) -> Option<Rate> {
        let (old, new) = (self.0.front()?, self.0.back()?);
        let wall_s = new.at.saturating_duration_since(old.at).as_secs_f64();
        (wall_s > 0.0).then(|| Rate {
            ticks_per_s: new.tick.saturating_sub(old.tick) as f64 / wall_s,
            real_time_factor: (new.time_s - old.time_s) / wall_s,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn old_marks_are_forgotten() {
        let start = Instant::now();
        let mut rates = Rates::default();
        rates.note(start, 0, 0.0);
        assert_eq!(rates.rate(), None);
        rates.note(start + Duration::from_secs(1), 100, 5.0);
        assert_eq!(rates.rate(), Some(Rate { ticks_per_s: 100.0, real_time_factor: 5.0 }));
        for second in 2..=4 {
            rates.note(start + Duration::from_secs(second), 100, 5.0);
        }
        assert_eq!(rates.rate(), Some(Rate { ticks_per_s: 0.0, real_time_factor: 0.0 }), "it stands");
    }
}

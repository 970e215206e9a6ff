//! How fast virtual time may pass, and what if the machine does not keep up.
//!
//! Pure: whoever asks tells what time it is.

use std::time::Duration;

use serde::{Deserialize, Serialize};

use squad::moment::Moment;

/// A delay up to this is made up for; a longer one, as after the arena was stopped, is not:
/// robots on their own timers could not follow a burst of ticks.
pub const CATCH_UP_MAX: Duration = Duration::from_millis(500);

/// Behavior in real time when the machine cannot keep up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Overload {
    /// The run fails as soon as the arena is a whole tick late.
    Fail,
    /// The arena makes up for up to half a second; what is more is lost, and the run says how much.
    #[default]
    Report,
    /// The arena makes up for nothing: ticks come later, none comes sooner than a step after the one before.
    SlowClock,
}

/// By how much a run was not in real time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Lag {
    /// Ticks that began a whole step too late, or later.
    pub late_ticks: u64,
    /// Ticks in all.
    pub ticks: u64,
    /// The worst delay of a tick, seconds of wall time.
    pub behind_max_s: f64,
    /// Wall time that was never made up for, seconds: virtual time is behind by this much.
    pub lost_s: f64,
}

/// Holds virtual time back to a multiple of real time.
#[derive(Clone, Copy, Debug)]
pub struct Pace {
    /// When the next tick is due.
    due: Moment,
    /// Virtual seconds per real second; `None` for "as fast as it can".
    factor: Option<f64>,
    overload: Overload,
    lag: Lag,
}

/// When the next tick may begin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Next {
    /// From then on; may have passed.
    pub due: Moment,
    /// How long ago it was due, if that is a whole step or more.
    pub late: Option<Duration>,
}

impl Pace {
    /// Begins `now`.
    pub fn new(factor: Option<f64>, overload: Overload, now: Moment) -> Self {
        Self { due: now, factor, overload, lag: Lag::default() }
    }

    /// It is `now`, and `step_s` of virtual time are to pass before the next tick. `None` if that may be at once.
    pub fn next(&mut self, step_s: f64, now: Moment) -> Option<Next> {
        let period = Duration::try_from_secs_f64(step_s / self.factor?).unwrap_or(Duration::MAX);
        self.due = self.due.checked_add(period).unwrap_or(self.due);
        let behind = now.since(self.due);
        let made_up = match self.overload {
            Overload::Fail | Overload::Report => CATCH_UP_MAX,
            Overload::SlowClock => Duration::ZERO,
        };
        let lost = behind.saturating_sub(made_up);
        self.due += lost;
        let late = Some(behind).filter(|behind| !behind.is_zero() && *behind >= period);
        self.lag.ticks += 1;
        self.lag.late_ticks += u64::from(late.is_some());
        self.lag.behind_max_s = self.lag.behind_max_s.max(behind.as_secs_f64());
        self.lag.lost_s += lost.as_secs_f64();
        Some(Next { due: self.due, late })
    }

    /// Virtual seconds per real second; `None` for "as fast as it can".
    pub fn factor(&self) -> Option<f64> {
        self.factor
    }

    /// Goes on by another factor, `now`.
    pub fn set_factor(&mut self, factor: Option<f64>, now: Moment) {
        self.factor = factor;
        self.begin_anew(now);
    }

    /// It is `now`, and no tick is late.
    pub fn begin_anew(&mut self, now: Moment) {
        self.due = now;
    }

    /// The whole run has stood still for so long by the wall clock: that is lost, and no tick hurries for it.
    pub fn stood_still(&mut self, time: Duration) {
        self.lag.late_ticks += 1;
        self.lag.behind_max_s = self.lag.behind_max_s.max(time.as_secs_f64());
        self.lag.lost_s += time.as_secs_f64();
    }

    /// Returns what is done about delays.
    pub fn overload(&self) -> Overload {
        self.overload
    }

    /// Delays so far.
    pub fn lag(&self) -> Lag {
        self.lag
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Duration = Duration::from_millis(1);

    /// Ticks of 100 ms that are asked for at these times (ms); when each is due, and by how much it is late.
    fn course(overload: Overload, asked: &[u32]) -> (Vec<(u128, Option<u128>)>, Lag) {
        let start = Moment::now();
        let mut pace = Pace::new(Some(2.0), overload, start);
        let next = |&ms: &u32| {
            let next = pace.next(0.2, start + ms * MS).unwrap();
            (next.due.since(start).as_millis(), next.late.map(|late| late.as_millis()))
        };
        (asked.iter().map(next).collect(), pace.lag())
    }

    #[test]
    fn without_a_factor_nothing_is_held_back() {
        assert_eq!(Pace::new(None, Overload::Report, Moment::now()).next(1.0, Moment::now()), None);
    }

    #[test]
    fn who_keeps_up_is_never_late() {
        let (course, lag) = course(Overload::Report, &[10, 150, 290]);
        assert_eq!(course, [(100, None), (200, None), (300, None)]);
        assert_eq!(lag, Lag { ticks: 3, ..Lag::default() });
    }

    #[test]
    fn a_short_delay_is_made_up_for_and_a_long_one_is_lost() {
        let (course, lag) = course(Overload::Report, &[350, 360, 2000, 2010]);
        assert_eq!(course, [(100, Some(250)), (200, Some(160)), (1500, Some(1700)), (1600, Some(410))]);
        assert_eq!((lag.late_ticks, lag.behind_max_s), (4, 1.7));
        assert!((lag.lost_s - 1.2).abs() < 1e-9);
    }

    #[test]
    fn a_standstill_is_lost_and_no_overload() {
        let mut pace = Pace::new(Some(1.0), Overload::Fail, Moment::now());
        pace.stood_still(3 * Duration::from_secs(1));
        let lag = pace.lag();
        assert_eq!((lag.late_ticks, lag.behind_max_s, lag.lost_s), (1, 3.0, 3.0));
        assert_eq!(pace.next(0.1, Moment::now()).unwrap().late, None);
    }

    #[test]
    fn a_slow_clock_never_hurries() {
        let (course, lag) = course(Overload::SlowClock, &[350, 360, 470, 1000]);
        assert_eq!(course, [(350, Some(250)), (450, None), (550, None), (1000, Some(350))]);
        assert!((lag.lost_s - 0.6).abs() < 1e-9);
    }
}

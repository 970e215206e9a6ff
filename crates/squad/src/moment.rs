//! A clock that stands still with this process: timeouts count by it.
//!
//! While a terminal has stopped a run's processes, nobody is late. The clock stands from the signal on, and not only
//! from the stop: so no thread sees the time jump that happens to run first afterwards.

use std::{
    ops::{Add, AddAssign},
    sync::{Mutex, MutexGuard, PoisonError},
    time::{Duration, Instant},
};

static CLOCK: Mutex<Clock> = Mutex::new(Clock { stood: Duration::ZERO, stands_since: None });

/// The time that this process has stood still.
#[derive(Debug)]
struct Clock {
    stood: Duration,
    stands_since: Option<Instant>,
}

/// A moment by a clock that stands still with this process.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Moment(Instant);

impl Moment {
    /// The present one.
    pub fn now() -> Self {
        let clock = clock();
        let now = clock.stands_since.unwrap_or_else(Instant::now);
        Self(now.checked_sub(clock.stood).expect("a process has not stood still for longer than it is there"))
    }

    /// Time since then.
    pub fn elapsed(self) -> Duration {
        Self::now().since(self)
    }

    /// Time from an `earlier` one on; none if that is later.
    pub fn since(self, earlier: Self) -> Duration {
        self.0.saturating_duration_since(earlier.0)
    }

    /// The moment `time` later; `None` if no clock can count that far.
    pub fn checked_add(self, time: Duration) -> Option<Self> {
        self.0.checked_add(time).map(Self)
    }
}

impl Add<Duration> for Moment {
    type Output = Self;

    fn add(self, time: Duration) -> Self {
        Self(self.0 + time)
    }
}

impl AddAssign<Duration> for Moment {
    fn add_assign(&mut self, time: Duration) {
        self.0 += time;
    }
}

/// A standstill that goes on: the clock stands from its beginning to its end.
#[derive(Debug)]
pub struct Standstill(Instant);

impl Standstill {
    /// Begins now.
    pub fn begin() -> Self {
        let now = Instant::now();
        clock().stands_since = Some(now);
        Self(now)
    }

    /// Ends now. Returns how long it took.
    pub fn end(self) -> Duration {
        let stood = self.0.elapsed();
        let mut clock = clock();
        clock.stood += stood;
        clock.stands_since = None;
        stood
    }
}

/// Tells how long this process has stood still.
#[derive(Debug)]
pub struct Standstills {
    /// Standstill told so far.
    told: Duration,
}

impl Standstills {
    /// Tells what comes from now on.
    pub fn begin() -> Self {
        Self { told: clock().stood }
    }

    /// How long since it was last asked; `None` if not at all.
    pub fn news(&mut self) -> Option<Duration> {
        let stood = clock().stood;
        let news = stood - self.told;
        self.told = stood;
        Some(news).filter(|news| !news.is_zero())
    }
}

fn clock() -> MutexGuard<'static, Clock> {
    CLOCK.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_stands_from_the_signal_on_and_goes_on_where_it_stood() {
        let (before, mut standstills) = (Moment::now(), Standstills::begin());
        let standstill = Standstill::begin();
        let standing = Moment::now();
        std::thread::sleep(Duration::from_millis(20));
        assert_eq!(Moment::now(), standing);
        let stood = standstill.end();
        assert!(Moment::now() >= standing && standing >= before);
        assert_eq!((standstills.news(), standstills.news()), (Some(stood), None));
    }
}

//! A robot's own timer: as even as its oscillator, and as prompt as its operating system.
//!
//! Pure: whoever asks tells what time it is. An agent begins a cycle whenever its timer fires, and has to be done
//! with it by the time it is due again. What it misses it does not make up for: there is one newest percept.

use std::time::{Duration, Instant};

use protocol::{oscillator::Oscillator, robot_id::RobotId, setup::ClockSetup, units::Seconds};

/// Fires once per period.
#[derive(Clone, Debug)]
pub(crate) struct Timer {
    /// By the robot's own clock, which is not quite that of the wall.
    period: Duration,
    jitter: Duration,
    oscillator: Oscillator,
    /// When the cycle to come begins; the one before has to be done by then.
    due: Instant,
    /// When the timer fires for it: then or a little later.
    fires: Instant,
}

/// A timer has fired.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Fired {
    /// By how much later the agent got to run.
    pub(crate) late: Duration,
    /// Periods that went by without a cycle.
    pub(crate) skipped: u32,
}

impl Timer {
    /// The timer of robot `id`, which fires at `now` for the first time. The same life of a robot has the
    /// same drift in every run of a seed; a restarted robot draws another. `None` if the cycle is longer than a clock
    /// can count.
    pub(crate) fn new(id: RobotId, cycle: Seconds, clock: &ClockSetup, now: Instant) -> Option<Self> {
        let oscillator = Oscillator::of(id, clock.seed, clock.drift_ppm);
        let period = Duration::try_from_secs_f64(cycle.get() * (1.0 + oscillator.drift())).ok()?;
        let jitter = Duration::try_from_secs_f64(clock.jitter.get()).ok()?;
        Some(Self { period, jitter, oscillator, due: now, fires: now })
    }

    /// When it fires.
    pub(crate) fn fires(&self) -> Instant {
        self.fires
    }

    /// Its period.
    pub(crate) fn period(&self) -> Duration {
        self.period
    }

    /// It has fired, and the agent runs `now`. From here on the next cycle is due in the same rhythm.
    pub(crate) fn fired(&mut self, now: Instant) -> Fired {
        let late = now.saturating_duration_since(self.fires);
        let skipped = now.saturating_duration_since(self.due).as_nanos() / self.period.as_nanos().max(1);
        let skipped = u32::try_from(skipped).unwrap_or(u32::MAX);
        self.due += self.period.saturating_mul(skipped.saturating_add(1));
        self.fires = self.due + self.jitter.mul_f64(self.oscillator.draw());
        Fired { late, skipped }
    }

    /// Whether a cycle that is done `now` has met its deadline.
    pub(crate) fn is_in_time(&self, now: Instant) -> bool {
        now <= self.due
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD: Duration = Duration::from_millis(100);

    fn timer(index: u32, drift_ppm: f64, jitter_s: f64, now: Instant) -> Timer {
        let seconds = |value| Seconds::new(value).unwrap();
        let clock = ClockSetup { drift_ppm, jitter: seconds(jitter_s), seed: 7 };
        Timer::new(RobotId::first(index), seconds(0.1), &clock, now).unwrap()
    }

    #[test]
    fn an_even_timer_keeps_its_rhythm_however_late_it_is_served() {
        let start = Instant::now();
        let mut timer = timer(0, 0.0, 0.0, start);
        let at = |ms| start + Duration::from_millis(ms);
        // When it runs, how late that is, what it has skipped, when it fires next.
        let course =
            [(0, 0, 0, 100), (105, 5, 0, 200), (299, 99, 0, 300), (300, 0, 0, 400), (655, 255, 2, 700)];
        for (ms, late, skipped, next) in course {
            let fired = timer.fired(at(ms));
            assert_eq!(fired, Fired { late: Duration::from_millis(late), skipped }, "{ms} ms");
            assert_eq!(timer.fires(), at(next), "{ms} ms");
        }
        assert!(timer.is_in_time(at(700)) && !timer.is_in_time(at(701)));
    }

    #[test]
    fn clocks_drift_both_ways_within_their_bound_and_the_same_in_every_run() {
        let now = Instant::now();
        let periods: Vec<f64> =
            (0..200).map(|index| timer(index, 100.0, 0.0, now).period().as_secs_f64() / 0.1 - 1.0).collect();
        assert!(periods.iter().all(|drift| drift.abs() <= 100.1e-6));
        let fast = periods.iter().filter(|&&drift| drift < 0.0).count();
        assert!((60..140).contains(&fast), "{fast} of 200 run fast");
        assert_eq!(timer(3, 100.0, 0.0, now).period(), timer(3, 100.0, 0.0, now).period());
        assert_ne!(timer(3, 100.0, 0.0, now).period(), timer(4, 100.0, 0.0, now).period());
    }

    #[test]
    fn jitter_delays_a_wake_up_but_not_the_rhythm() {
        let start = Instant::now();
        let mut timer = timer(0, 0.0, 0.02, start);
        let mut delays = Vec::new();
        for cycle in 1..=50 {
            timer.fired(timer.fires());
            delays.push(timer.fires() - (start + PERIOD * cycle));
        }
        assert!(delays.iter().all(|delay| *delay < Duration::from_millis(20)));
        let mean = delays.iter().sum::<Duration>() / 50;
        assert!((7..13).contains(&mean.as_millis()), "{mean:?}");
    }
}

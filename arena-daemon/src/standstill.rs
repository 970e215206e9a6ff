//! RobotStatus still as a whole when Ctrl-Z asks for it, and time that stands still meanwhile.
//!
//! A terminal stops a job by signals that reach its own process group alone. They are caught: what belongs to
//! this process is stopped first, then this process stops itself; once it is continued, so are the others. No
//! timeout may count that time, or everybody would be found late. Hence a clock of its own, which stands from the
//! signal on, and not only from the stop: so no thread sees the time jump that happens to run first afterwards.
//!
//! SIGSTOP cannot be caught: whoever sends it stops one process, and time goes on.

use std::{
    io,
    ops::{Add, AddAssign},
    sync::{Mutex, MutexGuard, PoisonError},
    thread,
    time::{Duration, Instant},
};

use nix::sys::signal::{SigSet, SigmaskHow, Signal};
use signal_hook::{
    consts::{SIGSTOP, SIGTSTP, SIGTTOU},
    iterator::Signals,
    low_level::raise,
};

/// Signals by which a terminal stops a job: Ctrl-Z, and output from the background where that is to wait
/// (`stty tostop`).
const TERMINAL_STOPS: [i32; 2] = [SIGTSTP, SIGTTOU];

/// The same, as signal masks have them.
const STOPS_MASKED: [Signal; 2] = [Signal::SIGTSTP, Signal::SIGTTOU];

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

/// From here on this process stands still when a terminal stops its job: `around` stops what belongs to it, calls
/// what it is given, which returns when this process is continued, and lets the others go on. It runs in a thread of
/// its own, whatever the others are doing.
pub fn on_signals(mut around: impl FnMut(fn()) + Send + 'static) -> io::Result<()> {
    let mut signals = Signals::new(TERMINAL_STOPS)?;
    thread::spawn(move || {
        // Who started this process may have held them back.
        SigSet::from_iter(STOPS_MASKED).thread_unblock().expect("every thread may change its mask");
        loop {
            if signals.wait().next().is_none() {
                continue;
            }
            let began = Instant::now();
            clock().stands_since = Some(began);
            around(stop_this_process);
            // Each write to a terminal that does not want it sends one more, until this process stands.
            signals.pending().for_each(drop);
            let mut clock = clock();
            clock.stood += began.elapsed();
            clock.stands_since = None;
        }
    });
    Ok(())
}

/// Calls `start`, which starts a child in a process group of its own, and holds back meanwhile what stops a terminal's
/// job. A child is of our group until it has left it, just before its own program begins: stopped there, it would
/// be continued by nobody, and whoever starts it would wait for that program for ever. The child goes on to hold
/// them back; [`on_signals`] ends that.
pub fn unstoppable<T>(start: impl FnOnce() -> T) -> T {
    let stops = SigSet::from_iter(STOPS_MASKED);
    let before = stops.thread_swap_mask(SigmaskHow::SIG_BLOCK).expect("every thread may change its mask");
    let started = start();
    before.thread_set_mask().expect("it has been the mask before");
    started
}

/// Returns when somebody has it continued.
fn stop_this_process() {
    raise(SIGSTOP).expect("every process may stop itself");
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
        let began = Instant::now();
        clock().stands_since = Some(began);
        let standing = Moment::now();
        thread::sleep(Duration::from_millis(20));
        assert_eq!(Moment::now(), standing);
        let stood = began.elapsed();
        {
            let mut clock = clock();
            (clock.stood, clock.stands_since) = (clock.stood + stood, None);
        }
        assert!(Moment::now() >= standing && standing >= before);
        assert_eq!((standstills.news(), standstills.news()), (Some(stood), None));
    }
}

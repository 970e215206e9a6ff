//! A clock that costs next to nothing to read, and counts alike in every process of one machine.
//!
//! In:  the processor's time stamp counter (TSC) where it is constant, else `CLOCK_MONOTONIC`.
//! Out: [`Stamp`]s, and by a [`Rate`] nanoseconds between them.
//!
//! A constant TSC counts reference cycles: at one rate on all cores, whatever the frequency they run at, and through
//! their sleep. Reading it waits for nothing that the processor has begun earlier, so a stamp may be some tens of
//! cycles off. On a machine with several sockets that are not in step, a stamp may lie before an earlier one of
//! another process: who compares such stamps must bear that.

#![allow(unsafe_code)] // Reading the counter, see `tsc`, and the monotonic clock.

use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};

/// A moment, counted from some moment before, by the [`Clock`] of this machine.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Stamp(pub u64);

impl Stamp {
    /// Returns the counts since `earlier`; `None` if that is later.
    pub fn since(self, earlier: Self) -> Option<u64> {
        self.0.checked_sub(earlier.0)
    }
}

/// Source of a clock's counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Source {
    /// The processor's time stamp counter: reference cycles.
    Tsc,
    /// The operating system's monotonic clock: nanoseconds.
    Monotonic,
}

/// The clock of this machine, the same in each of its processes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Clock {
    source: Source,
}

impl Clock {
    /// Asks the processor, which takes some microseconds on a virtual machine: once per process will do.
    pub fn of_this_machine() -> Self {
        Self { source: if tsc::is_constant() { Source::Tsc } else { Source::Monotonic } }
    }

    /// Returns the source of its counts.
    pub fn source(self) -> Source {
        self.source
    }

    /// This moment.
    #[inline]
    pub fn now(self) -> Stamp {
        match self.source {
            Source::Tsc => Stamp(tsc::read()),
            Source::Monotonic => Stamp(monotonic_ns()),
        }
    }
}

/// Measures how fast a [`Clock`] counts, beside the monotonic clock.
#[derive(Clone, Copy, Debug)]
pub struct Calibration {
    clock: Clock,
    began: (Stamp, Instant),
}

impl Calibration {
    /// The least time it takes. Both clocks are read within some 100 ns of each other, at either end, so the
    /// rate is then known to 1e-4 and better.
    pub const AT_LEAST: Duration = Duration::from_millis(5);

    /// From now on.
    pub fn begin(clock: Clock) -> Self {
        Self { clock, began: together(clock) }
    }

    /// The rate since [`Calibration::begin`]; waits if that was a moment ago.
    pub fn finish(&self) -> Rate {
        let (began, began_at) = self.began;
        std::thread::sleep(Self::AT_LEAST.saturating_sub(began_at.elapsed()));
        let (now, now_at) = together(self.clock);
        let elapsed = now_at - began_at;
        match self.clock.source {
            Source::Monotonic => Rate::NANOSECONDS,
            Source::Tsc => Rate::new(now.0.saturating_sub(began.0), elapsed),
        }
    }
}

/// How long a clock's unit is, to some 1e-9 of what was measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rate {
    /// Nanoseconds per count, times 2³².
    ns_per_count: u64,
}

impl Rate {
    /// Of a clock that counts nanoseconds.
    pub const NANOSECONDS: Self = Self { ns_per_count: 1 << 32 };

    fn new(counts: u64, elapsed: Duration) -> Self {
        let scaled = (elapsed.as_nanos() << 32) / u128::from(counts.max(1));
        Self { ns_per_count: u64::try_from(scaled).unwrap_or(u64::MAX) }
    }

    /// Converts counts to nanoseconds, rounded down.
    #[inline]
    pub fn ns(self, counts: u64) -> u64 {
        // Saturates beyond 584 years.
        u64::try_from((u128::from(counts) * u128::from(self.ns_per_count)) >> 32).unwrap_or(u64::MAX)
    }

    /// Counts per microsecond: of a time stamp counter, its frequency in MHz.
    pub fn per_us(self) -> f64 {
        1e3 * 4_294_967_296.0 / self.ns_per_count as f64
    }
}

/// One moment by both clocks: the closest of a few tries, for between two readings a process may lose its turn.
fn together(clock: Clock) -> (Stamp, Instant) {
    const TRIES: u32 = 10;
    let read = |_| {
        let (before, at, after) = (clock.now(), Instant::now(), clock.now());
        (after.0.saturating_sub(before.0), (before, at))
    };
    let tries = (0..TRIES).map(read).min_by_key(|&(apart, _)| apart);
    tries.expect("there is more than one try").1
}

fn monotonic_ns() -> u64 {
    let mut now = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: `now` is ours to write to, and that is all the call asks for.
    let status = unsafe { libc::clock_gettime(libc::CLOCK_MONOTONIC, &mut now) };
    assert_eq!(status, 0, "every Linux has a monotonic clock");
    now.tv_sec as u64 * 1_000_000_000 + now.tv_nsec as u64
}

/// The counter itself.
///
/// Contract of the `unsafe` here: `RDTSC` and `CPUID` touch no memory and are there on every x86-64 processor. An
/// operating system may forbid `RDTSC` (`prctl(PR_SET_TSC)`): then the process gets SIGSEGV, which is an end and no
/// undefined behavior. Nobody forbids it unasked.
#[cfg(target_arch = "x86_64")]
mod tsc {
    // `__cpuid` is a safe function in later Rust.
    #![allow(unused_unsafe)]

    use std::arch::x86_64::{__cpuid, _rdtsc};

    /// Leaf that says how far the extended leaves go.
    const EXTENDED: u32 = 0x8000_0000;
    /// Leaf with the bit for an invariant TSC.
    const POWER_MANAGEMENT: u32 = 0x8000_0007;
    /// That bit, of EDX.
    const INVARIANT_TSC: u32 = 1 << 8;

    pub(super) fn is_constant() -> bool {
        // SAFETY: see the module's contract. A leaf beyond the last one is not asked for.
        unsafe {
            __cpuid(EXTENDED).eax >= POWER_MANAGEMENT && __cpuid(POWER_MANAGEMENT).edx & INVARIANT_TSC != 0
        }
    }

    #[inline]
    pub(super) fn read() -> u64 {
        // SAFETY: see the module's contract.
        unsafe { _rdtsc() }
    }
}

/// Elsewhere there is no counter that we know to read.
#[cfg(not(target_arch = "x86_64"))]
mod tsc {
    pub(super) fn is_constant() -> bool {
        false
    }

    pub(super) fn read() -> u64 {
        super::monotonic_ns()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_does_not_run_backwards() {
        let clock = Clock::of_this_machine();
        let mut last = clock.now();
        for _ in 0..1000 {
            let now = clock.now();
            assert!(now.since(last).is_some(), "{now:?} after {last:?}");
            last = now;
        }
    }

    #[test]
    fn threads_agree_on_the_order_of_what_follows_from_each_other() {
        let clock = Clock::of_this_machine();
        let before = clock.now();
        let theirs = std::thread::spawn(move || clock.now()).join().unwrap();
        let after = clock.now();
        assert!(before <= theirs && theirs <= after, "{before:?} {theirs:?} {after:?}");
    }

    #[test]
    fn either_clock_measures_a_sleep_as_long_as_it_was() {
        for clock in [Clock::of_this_machine(), Clock { source: Source::Monotonic }] {
            let rate = Calibration::begin(clock).finish();
            let (began, began_at) = (clock.now(), Instant::now());
            std::thread::sleep(Duration::from_millis(20));
            let (ended, elapsed) = (clock.now(), began_at.elapsed().as_nanos() as f64);
            let measured = rate.ns(ended.since(began).unwrap()) as f64;
            assert!((measured / elapsed - 1.0).abs() < 1e-2, "{clock:?}: {measured} ns, truly {elapsed}");
        }
    }

    #[test]
    fn a_rate_scales_both_ways() {
        let rate = Rate::new(3_000_000, Duration::from_millis(1));
        assert!((rate.per_us() - 3000.0).abs() < 1e-3, "{}", rate.per_us());
        assert_eq!(rate.ns(3_000_000_000), 999_999_999, "rounded down");
        assert_eq!(Rate::NANOSECONDS.ns(u64::MAX), u64::MAX);
        assert_eq!(Rate::new(1, Duration::from_secs(3600)).ns(u64::MAX), u64::MAX);
    }
}

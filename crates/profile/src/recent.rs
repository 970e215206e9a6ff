//! Cycles of the last moments, for those who watch a run while it goes on.
//!
//! They are kept only as long as somebody watches. A cycle's `publish` is that of the cycle
//! before: a command cannot tell how long it took to send itself, and who watches does not want to wait for the next.

use std::{
    sync::{
        Arc, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
    time::Instant,
};

use super::{
    cycle_times::Stage,
    window::{Quantiles, Window},
};

/// Cycles kept of each robot. Their 99th percentile is the third longest.
const KEPT: usize = 256;

/// The last cycles of all robots.
#[derive(Debug)]
pub struct Recent {
    stages: [Window; Stage::ALL.len()],
    cycle: Window,
    packet: Window,
    robots: Vec<Robot>,
}

#[derive(Clone, Debug, Default)]
struct Robot {
    /// Lengths of the last cycles, nanoseconds, in a ring.
    cycles_ns: Vec<u32>,
    /// Where the next one goes.
    next: usize,
    wake_ns: u32,
}

/// Cycles of the last moments, shared by who measures them and who shows them.
#[derive(Clone, Debug, Default)]
pub struct WatchedCycles(Arc<Shared>);

#[derive(Debug, Default)]
struct Shared {
    /// Whether there is something below: a look costs less than the lock.
    watched: AtomicBool,
    recent: Mutex<Option<Recent>>,
}

impl WatchedCycles {
    /// Has cycles of so many robots kept from now on if the run is `watched`, and no longer if not.
    pub fn watch(&self, robots: usize, watched: bool) {
        if watched != self.are_watched() {
            *self.lock() = watched.then(|| Recent::new(robots, Instant::now()));
            self.0.watched.store(watched, Ordering::Relaxed);
        }
    }

    /// Whether somebody watches.
    pub fn are_watched(&self) -> bool {
        self.0.watched.load(Ordering::Relaxed)
    }

    /// Does something with them, if somebody watches.
    #[inline]
    pub fn with<T>(&self, act: impl FnOnce(&mut Recent) -> T) -> Option<T> {
        if self.are_watched() { self.lock().as_mut().map(act) } else { None }
    }

    /// Each change is whole, so one that panicked has broken nothing.
    fn lock(&self) -> MutexGuard<'_, Option<Recent>> {
        self.0.recent.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Times that agents took in the last moments. `None` where nothing was measured.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct RecentTimes {
    /// Stages of their cycles, in the order of [`Stage::ALL`].
    pub stages: [Option<Quantiles>; Stage::ALL.len()],
    /// Whole cycles.
    pub cycle: Option<Quantiles>,
    /// Transport time of a packet, beyond what is modeled.
    pub packet: Option<Quantiles>,
}

/// Times that one robot's agent took in its last cycles, microseconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct RecentCycles {
    /// The last one.
    pub last_us: f64,
    /// 99th percentile of the last 256.
    pub p99_us: f64,
    /// The last wake-up.
    pub wake_us: f64,
}

impl Recent {
    /// Begins `now`, for so many robots.
    pub fn new(robots: usize, now: Instant) -> Self {
        let window = || Window::new(now);
        Self {
            stages: std::array::from_fn(|_| window()),
            cycle: window(),
            packet: window(),
            robots: vec![Robot::default(); robots],
        }
    }

    /// One more cycle of robot `index`, stage by stage.
    pub fn note(&mut self, index: usize, stages_ns: [u32; Stage::ALL.len()]) {
        self.stages.iter_mut().zip(stages_ns).for_each(|(window, ns)| window.record(ns.into()));
        let [wake_ns, cycle @ ..] = stages_ns;
        let cycle_ns = cycle.iter().map(|&ns| u64::from(ns)).sum();
        self.cycle.record(cycle_ns);
        let robot = &mut self.robots[index];
        robot.wake_ns = wake_ns;
        let cycle_ns = u32::try_from(cycle_ns).unwrap_or(u32::MAX);
        match robot.cycles_ns.get_mut(robot.next) {
            Some(oldest) => *oldest = cycle_ns,
            None => robot.cycles_ns.push(cycle_ns),
        }
        robot.next = (robot.next + 1) % KEPT;
    }

    /// One more packet, nanoseconds.
    pub fn packet(&mut self, ns: u64) {
        self.packet.record(ns);
    }

    /// Robot `index` begins a new life.
    pub fn reborn(&mut self, index: usize) {
        self.robots[index] = Robot::default();
    }

    /// Times of all agents, by `now`.
    pub fn times(&mut self, now: Instant) -> RecentTimes {
        RecentTimes {
            stages: self.stages.each_mut().map(|window| window.quantiles(now)),
            cycle: self.cycle.quantiles(now),
            packet: self.packet.quantiles(now),
        }
    }

    /// The last cycles of robot `index`; `None` if it had none.
    pub fn cycles(&self, index: usize) -> Option<RecentCycles> {
        let Robot { cycles_ns, next, wake_ns } = &self.robots[index];
        let mut sorted = cycles_ns.clone();
        let rank = (sorted.len() * 99).div_ceil(100).checked_sub(1)?;
        let (_, p99_ns, _) = sorted.select_nth_unstable(rank);
        let last_ns = cycles_ns[next.checked_sub(1).unwrap_or(cycles_ns.len() - 1)];
        let us = |ns: u32| f64::from(ns) / 1e3;
        Some(RecentCycles { last_us: us(last_ns), p99_us: us(*p99_ns), wake_us: us(*wake_ns) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_cycles_of_a_robot_are_known() {
        let now = Instant::now();
        let mut recent = Recent::new(2, now);
        assert_eq!(recent.cycles(1), None);
        for cycle in 1..=KEPT as u32 + 44 {
            recent.note(1, [7_000, cycle * 1000, 0, 0, 0, 0, 0, 0]);
        }
        // 45 to 300 are left of 300.
        let cycles = recent.cycles(1).unwrap();
        assert_eq!(cycles, RecentCycles { last_us: 300.0, p99_us: 298.0, wake_us: 7.0 });
        assert_eq!(recent.cycles(0), None);
        let times = recent.times(now);
        assert_eq!((times.cycle.unwrap().count, times.packet), (300, None));
        assert_eq!(times.stages[0].unwrap().max_us.round(), 7.0);
        recent.reborn(1);
        assert_eq!(recent.cycles(1), None);
        recent.note(1, [0, 5_000, 0, 0, 0, 0, 0, 1_000]);
        assert_eq!(recent.cycles(1).unwrap().last_us, 6.0);
    }
}

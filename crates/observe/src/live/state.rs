//! State of a run that its loop tells and others ask for.

use std::{
    sync::{
        Mutex, MutexGuard, PoisonError,
        atomic::{AtomicU64, Ordering},
    },
    time::{Duration, Instant},
};

use super::snapshot::{About, Phase, Snapshot};

/// A client that has asked this long ago still watches.
const WATCHES_FOR: Duration = Duration::from_secs(1);

/// State of a run that its loop tells and others ask for.
#[derive(Debug)]
pub struct Live {
    began: Instant,
    /// Somebody watches to the end, and may ask seldom.
    always: bool,
    /// Milliseconds since then at which somebody has asked last, plus one; 0 if nobody has.
    asked_ms: AtomicU64,
    state: Mutex<State>,
}

#[derive(Debug)]
struct State {
    snapshot: Snapshot,
    /// When ticks began to pass.
    started: Option<Instant>,
}

impl Live {
    /// Of a run that is about to begin. `always`: it is watched to its end, however seldom somebody asks.
    pub fn new(of: About, ticks: u64, always: bool) -> Self {
        let state = State { snapshot: Snapshot::begin(of, ticks), started: None };
        Self { began: Instant::now(), always, asked_ms: AtomicU64::new(0), state: Mutex::new(state) }
    }

    /// The run as it was told last.
    pub fn ask(&self) -> Snapshot {
        self.asked_ms.store(self.now_ms() + 1, Ordering::Relaxed);
        let state = self.state();
        let mut snapshot = state.snapshot.clone();
        if let (Phase::Running, Some(started)) = (snapshot.phase, state.started) {
            snapshot.wall_s = started.elapsed().as_secs_f64();
        }
        snapshot
    }

    /// Whether somebody watches.
    pub fn is_watched(&self) -> bool {
        let asked = self.asked_ms.load(Ordering::Relaxed);
        self.always || asked > 0 && self.now_ms() < asked + WATCHES_FOR.as_millis() as u64
    }

    /// Changes the snapshot.
    pub(super) fn tell(&self, change: impl FnOnce(&mut Snapshot)) {
        change(&mut self.state().snapshot);
    }

    /// The first tick begins.
    pub(super) fn start(&self) {
        let mut state = self.state();
        state.started = Some(Instant::now());
        state.snapshot.phase = Phase::Running;
        state.snapshot.waiting = None;
    }

    /// The last tick has passed.
    pub(super) fn end(&self) {
        let mut state = self.state();
        if let Some(started) = state.started {
            state.snapshot.wall_s = started.elapsed().as_secs_f64();
        }
        state.snapshot.phase = Phase::Over;
        state.snapshot.waiting = None;
    }

    fn now_ms(&self) -> u64 {
        self.began.elapsed().as_millis() as u64
    }

    /// A snapshot is whole between any two of its changes, so one that panicked has broken nothing.
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::{super::snapshot::about, *};

    #[test]
    fn who_asks_watches_for_a_while() {
        let live = Live::new(about(), 10, false);
        assert!(!live.is_watched());
        assert_eq!(live.ask().phase, Phase::Gathering);
        assert!(live.is_watched());
        live.asked_ms.store(1, Ordering::Relaxed);
        std::thread::sleep(WATCHES_FOR + Duration::from_millis(10));
        assert!(!live.is_watched());
        assert!(Live::new(about(), 10, true).is_watched());
    }

    #[test]
    fn wall_time_passes_between_snapshots_until_the_end() {
        let live = Live::new(about(), 10, false);
        live.start();
        std::thread::sleep(Duration::from_millis(2));
        let first = live.ask();
        assert!(first.wall_s >= 0.002 && first.phase == Phase::Running);
        live.end();
        let last = live.ask();
        std::thread::sleep(Duration::from_millis(2));
        assert!(last.wall_s >= first.wall_s && live.ask() == last);
    }
}

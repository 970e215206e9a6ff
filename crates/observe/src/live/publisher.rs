//! Publishes snapshots of a run for those who watch it.

use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use arena::packets::Packets;
use engine::{Acted, Observer, ObserverError, RunInfo, TickView, Waiting, summary::Summary};
use profile::{WatchedCycles, Window};
use protocol::percept::Tick;

use super::{
    snapshot::{Robot, Snapshot},
    state::Live,
};

/// Time between two snapshots.
const EVERY: Duration = Duration::from_millis(100);

/// Publishes snapshots of a run.
#[derive(Debug)]
pub struct SnapshotPublisher {
    live: Arc<Live>,
    /// Last cycles of the agents, if they are measured; kept only while somebody watches.
    cycles: WatchedCycles,
    told: Option<Instant>,
    /// While somebody watches.
    ticks: Option<Window>,
    /// How far the run is: the snapshot may be a tenth of a second behind, in which a fast run goes far.
    position: Option<Position>,
}

/// How far a run is.
#[derive(Clone, Copy, Debug)]
struct Position {
    tick: Tick,
    time_s: f64,
    mean_error_m: Option<f64>,
    packets: Packets,
}

impl Position {
    fn of(tick: &TickView<'_>) -> Self {
        Self {
            tick: tick.tick(),
            time_s: tick.time_s(),
            mean_error_m: tick.errors().mean_m,
            packets: tick.packets(),
        }
    }

    fn write(self, snapshot: &mut Snapshot) {
        let Self { tick, time_s, mean_error_m, packets } = self;
        (snapshot.tick, snapshot.time_s) = (tick, time_s);
        (snapshot.mean_error_m, snapshot.packets) = (mean_error_m, packets);
    }
}

impl SnapshotPublisher {
    /// A publisher to `live` of a run whose agents' last cycles are kept in `cycles`, if they are measured.
    pub fn new(live: Arc<Live>, cycles: WatchedCycles) -> Self {
        Self { live, cycles, told: None, ticks: None, position: None }
    }

    fn publish(&mut self, tick: &TickView<'_>, now: Instant) {
        let watched = self.live.is_watched();
        self.cycles.watch(tick.poses().len(), watched);
        if watched != self.ticks.is_some() {
            self.ticks = watched.then(|| Window::new(now));
        }
        let tick_time = self.ticks.as_mut().and_then(|ticks| ticks.quantiles(now));
        let agents = self.cycles.with(|recent| recent.times(now));
        let robots = tick.robots().into_iter().enumerate().map(|(index, robot)| Robot {
            id: robot.id,
            pid: robot.pid,
            participation: robot.participation,
            cycles: self.cycles.with(|recent| recent.cycles(index)).flatten(),
            missed_deadlines: robot.missed_deadlines,
            refused: robot.refused,
        });
        let robots = robots.collect();
        self.live.tell(|snapshot| {
            Position::of(tick).write(snapshot);
            snapshot.tick_time = tick_time;
            (snapshot.robots, snapshot.agents) = (robots, agents);
        });
    }
}

impl Observer for SnapshotPublisher {
    fn started(&mut self, run: &RunInfo<'_>) -> Result<(), ObserverError> {
        self.live.start();
        self.live.tell(|snapshot| snapshot.speed = run.speed);
        Ok(())
    }

    fn acted(&mut self, acted: &Acted<'_>) {
        let position = self.position;
        self.live.tell(|snapshot| {
            position.into_iter().for_each(|position| position.write(snapshot));
            (snapshot.is_held, snapshot.speed) = (acted.is_held, acted.speed);
        });
    }

    fn ticked(&mut self, tick: &TickView<'_>) -> Result<(), ObserverError> {
        if let Some(ticks) = &mut self.ticks {
            ticks.record(tick.took().as_nanos() as u64);
        }
        self.position = Some(Position::of(tick));
        let now = Instant::now();
        if self.told.is_none_or(|told| now.saturating_duration_since(told) >= EVERY) {
            self.told = Some(now);
            self.publish(tick, now);
        }
        Ok(())
    }

    fn waiting(&mut self, waiting: Option<&Waiting>) {
        let position = self.position;
        self.live.tell(|snapshot| {
            position.into_iter().for_each(|position| position.write(snapshot));
            snapshot.waiting = waiting.cloned();
        });
    }

    /// Tells how things are a last time.
    fn summarize(&mut self, end: &TickView<'_>, _: &mut Summary) -> Result<(), ObserverError> {
        self.publish(end, Instant::now());
        self.live.end();
        Ok(())
    }
}

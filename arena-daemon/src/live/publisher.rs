//! Publishes snapshots of a run for those who watch it.

use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use arena::packets::Packets;

use super::{Agents, EVERY, Live, Robot, Waiting};
use crate::{profile::Window, progress::Status, squad::Squad};

/// Status of a squad.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SquadStatus {
    /// All robots, by index.
    pub robots: Vec<Robot>,
    /// Times that their agents took, if measured.
    pub agents: Option<Agents>,
    /// Robots that have not been heard for too long.
    pub waiting: Option<Waiting>,
}

/// Publishes snapshots, if the run can be watched.
#[derive(Debug)]
pub struct SnapshotPublisher {
    live: Option<Arc<Live>>,
    told: Option<Instant>,
    /// While somebody watches.
    ticks: Option<Window>,
}

impl SnapshotPublisher {
    /// A publisher to `live`; without it, nothing is published.
    pub fn new(live: Option<Arc<Live>>) -> Self {
        Self { live, told: None, ticks: None }
    }

    /// The first tick begins.
    pub fn start(&self) {
        self.live.iter().for_each(|live| live.start());
    }

    /// A tick took so long.
    pub fn ticked(&mut self, took: Duration) {
        if let Some(ticks) = &mut self.ticks {
            ticks.record(took.as_nanos() as u64);
        }
    }

    /// Publishes a snapshot, if it is time to.
    pub fn tell(&mut self, status: &Status, packets: impl FnOnce() -> Packets, squad: &mut dyn Squad) {
        let Some(live) = &self.live else { return };
        let now = Instant::now();
        if self.told.is_some_and(|told| now.saturating_duration_since(told) < EVERY) {
            return;
        }
        self.told = Some(now);
        let watched = live.is_watched();
        if watched != self.ticks.is_some() {
            self.ticks = watched.then(|| Window::new(now));
        }
        let tick_time = self.ticks.as_mut().and_then(|ticks| ticks.quantiles(now));
        let SquadStatus { robots, agents, waiting } = squad.status_of_robots(watched);
        let packets = packets();
        live.tell(|snapshot| {
            snapshot.tick = status.tick;
            snapshot.time_s = status.time_s;
            snapshot.mean_error_m = status.errors.mean_m;
            (snapshot.packets, snapshot.tick_time) = (packets, tick_time);
            (snapshot.robots, snapshot.agents, snapshot.waiting) = (robots, agents, waiting);
        });
    }

    /// The last tick has passed: tells how things are a last time.
    pub fn end(&mut self, status: &Status, packets: Packets, squad: &mut dyn Squad) {
        self.told = None;
        self.tell(status, || packets, squad);
        self.live.iter().for_each(|live| live.end());
    }
}

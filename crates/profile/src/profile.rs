//! The profile of a run: what was measured of each robot's agent, by which clock.

use std::{
    fmt,
    time::{Duration, SystemTime},
};

use protocol::setup::Mode;
use serde::{Deserialize, Serialize};

use crate::{
    histograms::Histograms,
    usage::{Counted, Usage},
};

/// Measurements of the agents of a run.
#[derive(Debug)]
pub struct Profile {
    /// The clock they were measured by.
    pub clock: ClockUsed,
    /// Which counters of the processor were read beside it; or why none.
    pub hardware_counters: String,
    /// How they kept time.
    pub mode: Mode,
    /// When all had joined.
    pub began: SystemTime,
    /// How long they have been measured since.
    pub length: Duration,
    /// By index.
    pub robots: Vec<RobotProfile>,
    /// Cycles that were left out: their stamps made no sense, or in real time the answer came several cycles late.
    pub cycles_left_out: u64,
    /// Packets handed out whose way to the arena is not known, so that their latency is not: first packets,
    /// packets that a fault delayed by several cycles, and those in a false name.
    pub packets_unknown: u64,
}

/// Source of a clock's counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Source {
    /// The processor's time stamp counter, which counts reference cycles.
    Tsc,
    /// The operating system's monotonic clock.
    Monotonic,
}

impl fmt::Display for Source {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.serialize(f)
    }
}

/// The clock that agents were measured by.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ClockUsed {
    /// Source of its counts.
    pub source: Source,
    /// How often per microsecond.
    pub mhz: f64,
}

/// Measurements of one robot's agent, over all its lives.
#[derive(Debug)]
pub struct RobotProfile {
    /// Of everything that is measured by the clock.
    pub histograms: Histograms,
    /// Whole cycles measured.
    pub cycles: u64,
    /// Counts of the clock in them.
    pub counts: u64,
    /// In real time: timer periods that went by without a cycle.
    pub missed_deadlines: u64,
    /// Resources that the process of its present life has used, if it was there at the end.
    pub usage: Option<Usage>,
    /// Processor counters of that process, where there are any and its life began with the run.
    pub counted: Option<Counted>,
}

impl Profile {
    /// The histograms of all robots in one.
    pub fn over_all(&self) -> Histograms {
        let mut all = Histograms::default();
        self.robots.iter().for_each(|robot| all.add(&robot.histograms));
        all
    }
}

impl RobotProfile {
    /// Counts of the clock per whole cycle, on average; `None` if there was none.
    pub fn counts_per_cycle(&self) -> Option<f64> {
        (self.cycles > 0).then(|| self.counts as f64 / self.cycles as f64)
    }
}

//! A run at one moment, as those see it who watch it: plain data, which crosses the run's socket as JSON.

use arena::packets::Packets;
use engine::{Participation, Waiting};
use profile::{Quantiles, RecentCycles, RecentTimes};
use protocol::{robot_id::RobotId, setup::Mode};
use serde::{Deserialize, Serialize};

/// A run at one moment.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Snapshot {
    /// Which run it is.
    pub of: About,
    /// How far it has come.
    pub phase: Phase,
    /// Tick reached.
    pub tick: u64,
    /// Ticks in all.
    pub ticks: u64,
    /// Virtual time reached.
    pub time_s: f64,
    /// Seconds since the first tick, by the wall clock.
    pub wall_s: f64,
    /// Whether somebody holds its ticks back.
    pub is_held: bool,
    /// Virtual over real time at most; `None` for as fast as it can.
    pub speed: Option<f64>,
    /// Mean ‖ê‖ over the robots that estimate one; `None` if none does.
    pub mean_error_m: Option<f64>,
    /// Packets since the start.
    pub packets: Packets,
    /// Wall time of a tick, in the last seconds; `None` if nobody has watched for long enough.
    pub tick_time: Option<Quantiles>,
    /// Times that agents took, in the last seconds; the same.
    pub agents: Option<RecentTimes>,
    /// All robots, by index.
    pub robots: Vec<Robot>,
    /// Robots that are waited for.
    pub waiting: Option<Waiting>,
    /// Clients of the run's sockets that have not got their answer.
    pub dropped: Dropped,
}

/// Clients that were dropped before they had their answer, by why.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Dropped {
    /// They took too long to ask, or to read.
    pub late: u64,
    /// There were too many at once, and they had been there for longest.
    pub crowded_out: u64,
    /// Ticks that those who watch were not told of, because they had not read the ones before; their clients stay.
    pub ticks: u64,
}

/// Facts that do not change in a run.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct About {
    /// Name of the run, or of the scenario if the run has none.
    pub run: String,
    /// Name of the scenario.
    pub scenario: String,
    /// `processes` or `in-process`.
    pub engine: String,
    /// How time passes.
    pub mode: Mode,
    /// Process of the arena.
    pub arena_pid: u32,
}

/// How far a run has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Phase {
    /// Robots are still joining.
    Gathering,
    /// Ticks pass.
    Running,
    /// The last tick has passed.
    Over,
}

/// One robot and its agent.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Robot {
    /// The robot and its present life.
    pub id: RobotId,
    /// Process of its agent, if it has one.
    pub pid: Option<u32>,
    /// Whether it takes part.
    pub participation: Participation,
    /// Its last cycles, if they are measured.
    pub cycles: Option<RecentCycles>,
    /// In real time, timer periods that went by without a cycle, if that is measured.
    pub missed_deadlines: Option<u64>,
    /// Commands refused.
    pub refused: u64,
}

impl Snapshot {
    /// Before the first robot has come.
    pub fn begin(of: About, ticks: u64) -> Self {
        Self {
            of,
            phase: Phase::Gathering,
            tick: 0,
            ticks,
            time_s: 0.0,
            wall_s: 0.0,
            is_held: false,
            speed: None,
            mean_error_m: None,
            packets: Packets::default(),
            tick_time: None,
            agents: None,
            robots: Vec::new(),
            waiting: None,
            dropped: Dropped::default(),
        }
    }

    /// Virtual over wall time since the first tick.
    pub fn real_time_factor(&self) -> Option<f64> {
        (self.wall_s > 0.0).then(|| self.time_s / self.wall_s)
    }

    /// How many robots stand so.
    pub fn count(&self, participation: Participation) -> usize {
        self.robots.iter().filter(|robot| robot.participation == participation).count()
    }
}

/// A run for tests.
#[cfg(test)]
pub(super) fn about() -> About {
    About {
        run: "lab".into(),
        scenario: "swarmbots".into(),
        engine: "processes".into(),
        mode: Mode::Lockstep,
        arena_pid: 42,
    }
}

//! A run at one moment, as those see it who watch it: plain data, which crosses the run's socket as JSON.

use std::fmt;

use arena::packets::Packets;
use protocol::{robot_id::RobotId, setup::Mode};
use serde::{Deserialize, Serialize};

use crate::profile::{Quantiles, RecentCycles, RecentTimes, Stage};

/// Robots that are waited for and named; the others are counted.
pub const NAMED_MAX: usize = 8;

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
    /// Mean ‖ê‖ over the robots that estimate one; `None` if none does.
    pub mean_error_m: Option<f64>,
    /// Packets since the start.
    pub packets: Packets,
    /// Wall time of a tick, in the last seconds; `None` if nobody has watched for long enough.
    pub tick_time: Option<Quantiles>,
    /// Times that agents took, in the last seconds; the same.
    pub agents: Option<Agents>,
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

/// Times that agents took. `None` where nothing was measured.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Agents {
    /// Stages of their cycles, in their order.
    pub stages: [Option<Quantiles>; Stage::ALL.len()],
    /// Whole cycles.
    pub cycle: Option<Quantiles>,
    /// Transport time of a packet, beyond what is modeled.
    pub packet: Option<Quantiles>,
}

impl From<RecentTimes> for Agents {
    fn from(RecentTimes { stages, cycle, packet }: RecentTimes) -> Self {
        Self { stages, cycle, packet }
    }
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
    /// In real time, timer periods that went by without a cycle.
    pub missed_deadlines: u64,
    /// Commands refused.
    pub refused: u64,
}

/// Whether a robot takes part.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Participation {
    /// Its agent has not joined yet.
    Expected,
    /// It does.
    Present,
    /// The plan has stopped its agent.
    Paused,
    /// The plan has killed it.
    Down,
    /// It is left out for good, unplanned.
    Out,
}

impl Participation {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Expected, Self::Present, Self::Paused, Self::Down, Self::Out];

    /// As outputs spell it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Expected => "expected",
            Self::Present => "present",
            Self::Paused => "paused",
            Self::Down => "down",
            Self::Out => "out",
        }
    }
}

/// Robots that the run, or those who watch it, wait for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Waiting {
    /// For what.
    pub what: Awaited,
    /// The tick that cannot go on, or the last one.
    pub tick: u64,
    /// How many robots.
    pub count: usize,
    /// Some of them, at most [`NAMED_MAX`], the most suspicious first.
    pub robots: Vec<Waited>,
}

/// Reason why robots are waited for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Awaited {
    /// The run stands until they join.
    Join,
    /// Lock-step: the tick stands until they answer.
    Answer,
    /// Real time: nothing stands, but they have not been heard for longer than they should.
    Sign,
}

/// One robot that is waited for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Waited {
    /// The robot and its present life.
    pub id: RobotId,
    /// Process of its agent, if it has one.
    pub pid: Option<u32>,
    /// State of that process, in a word.
    pub state: Option<String>,
    /// Since when, seconds.
    pub for_s: f64,
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

impl Waiting {
    /// The longest anybody is waited for, seconds.
    pub fn longest_s(&self) -> f64 {
        self.robots.iter().map(|robot| robot.for_s).fold(0.0, f64::max)
    }
}

impl fmt::Display for Waited {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.id)?;
        match (self.pid, &self.state) {
            (Some(pid), Some(state)) => write!(f, " (pid {pid}, {state})"),
            (Some(pid), None) => write!(f, " (pid {pid})"),
            (None, _) => Ok(()),
        }
    }
}

/// `tick 812 waits for robot 17 (pid 4242, stopped) since 1.2 s`.
impl fmt::Display for Waiting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (tick, longest_s) = (self.tick, self.longest_s());
        match self.what {
            Awaited::Answer => write!(f, "tick {tick} waits for ")?,
            Awaited::Join => write!(f, "the run waits for the agent of ")?,
            Awaited::Sign => write!(f, "silent: ")?,
        }
        for (place, robot) in self.robots.iter().enumerate() {
            write!(f, "{}{robot}", if place > 0 { ", " } else { "" })?;
        }
        match self.count - self.robots.len() {
            0 => write!(f, " since {longest_s:.1} s"),
            more => write!(f, " and {more} more since {longest_s:.1} s"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn waited(index: u32, state: Option<&str>) -> Waited {
        let pid = state.map(|_| 4242);
        Waited { id: RobotId::first(index), pid, state: state.map(Into::into), for_s: 1.23 }
    }

    #[test]
    fn who_is_waited_for_is_named() {
        let one = vec![waited(17, Some("stopped"))];
        let waiting = |what, count, robots| Waiting { what, tick: 812, count, robots }.to_string();
        assert_eq!(
            waiting(Awaited::Answer, 1, one.clone()),
            "tick 812 waits for robot 17 (pid 4242, stopped) since 1.2 s"
        );
        assert_eq!(waiting(Awaited::Sign, 1, one), "silent: robot 17 (pid 4242, stopped) since 1.2 s");
        let two = vec![waited(0, None), waited(1, None)];
        assert_eq!(
            waiting(Awaited::Join, 50, two),
            "the run waits for the agent of robot 0, robot 1 and 48 more since 1.2 s"
        );
    }
}

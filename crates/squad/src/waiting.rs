//! Robots that a run waits for.

use std::fmt;

use protocol::robot_id::RobotId;
use serde::{Deserialize, Serialize};

/// Robots that are waited for and named; the others are counted.
pub const NAMED_MAX: usize = 8;

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

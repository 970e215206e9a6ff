//! Status of one robot's agent.

use protocol::robot_id::RobotId;
use serde::{Deserialize, Serialize};

/// Status of one robot's agent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RobotStatus {
    /// The robot and its present life.
    pub id: RobotId,
    /// Process of its agent, if it has one.
    pub pid: Option<u32>,
    /// Whether it takes part.
    pub participation: Participation,
    /// Commands that were refused.
    pub refused: u64,
    /// In real time, timer periods that went by without a cycle, as far as that is measured.
    pub missed_deadlines: Option<u64>,
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

impl RobotStatus {
    /// Whether it is neither killed by the plan nor left out, nor has still to join.
    pub fn is_alive(&self) -> bool {
        matches!(self.participation, Participation::Present | Participation::Paused)
    }

    /// Whether the plan has paused it.
    pub fn is_paused(&self) -> bool {
        self.participation == Participation::Paused
    }
}

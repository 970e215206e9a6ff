//! Identity of a robot: its index and its life.

use serde::{Deserialize, Serialize};

/// A robot's identity: its index in the scenario and how often its agent has been restarted.
///
/// A restarted robot has lost its memory and carries a new incarnation, so it is never mistaken
/// for its dead self.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct RobotId {
    /// Number of the robot, from 0.
    pub index: u32,
    /// Number of restarts before this life.
    pub incarnation: u16,
}

impl RobotId {
    /// The first life of robot `index`.
    pub const fn first(index: u32) -> Self {
        Self { index, incarnation: 0 }
    }

    /// The life after this one.
    #[must_use]
    pub const fn reborn(self) -> Self {
        Self { incarnation: self.incarnation.wrapping_add(1), ..self }
    }
}

impl core::fmt::Display for RobotId {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self.incarnation {
            0 => write!(f, "robot {}", self.index),
            n => write!(f, "robot {} (life {})", self.index, u32::from(n) + 1),
        }
    }
}

//! Setup of an agent before its first tick: parameters of its controller, as bytes, and how to keep time.
//!
//! The same for every robot with the same controller, and silent about how many there are.

use serde::{Deserialize, Serialize};

#[cfg(feature = "std")]
use crate::params::Params;
use crate::units::Seconds;

/// How agents keep time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Mode {
    /// The doorbell raises each tick and the arena waits for every live robot.
    Lockstep,
    /// Every agent runs on its own timer.
    Realtime,
}

/// Transport of percepts and commands between the arena and its agents.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Plane {
    /// One latest value per direction, which the next one replaces: what lock-step needs.
    Blackboard,
    /// Short queues: in real time a message that comes while another waits does not replace it.
    PublishSubscribe,
}

impl Mode {
    /// The plane that suits it.
    pub fn plane(self) -> Plane {
        match self {
            Self::Lockstep => Plane::Blackboard,
            Self::Realtime => Plane::PublishSubscribe,
        }
    }
}

/// How good a robot's own clock is: in real time it wakes up by it, and where its infrared runs free it sends by it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ClockSetup {
    /// Each clock runs fast or slow by a share of its own, up to this many parts per million.
    pub drift_ppm: f64,
    /// Each wake-up comes late by a time of its own, up to this.
    pub jitter: Seconds,
    /// Seed of both, together with the robot's id: each life of it has a clock of its own.
    pub seed: u64,
}

/// Everything an agent needs to start.
#[cfg(feature = "std")]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AgentSetup {
    /// How to keep time.
    pub mode: Mode,
    /// Transport of messages.
    pub plane: Plane,
    /// Longest payload of a packet that the arena accepts, in bytes.
    pub payload_bytes_max: u8,
    /// Length of a neighbor cycle: how often an agent hears of the world and answers.
    pub cycle: Seconds,
    /// The robot's own clock.
    pub clock: ClockSetup,
    /// Parameters of the controller, in its own form: nobody else reads them.
    pub params: Params,
    /// Most private memory that its process may have, bytes; `None` for as much as there is.
    pub memory_max_bytes: Option<u64>,
    /// The arena's namespace of process numbers, if it is known (`transport::pid_namespace`).
    pub pid_namespace: Option<u64>,
}

//! Setup of an agent before its first tick: parameters of its controller and how to keep time.
//!
//! The same for every robot of a run, and silent about how many there are.

use serde::{Deserialize, Serialize};

use crate::units::{Meters, MetersPerSecond, Seconds};

/// Which control law moves the robot.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Law {
    /// The paper: φ estimated by value and gradient at the robot (eq. 10 to 18).
    Linear,
    /// The paper's outlook: φ fitted by a quadratic to the robot's own reading and its neighbors'.
    Quadratic,
    /// φ constant: plain Lloyd descent, no light needed.
    Uniform,
    /// The optimal baseline: the true field is known (Cortés et al.).
    Exact,
}

/// How the robot gets the gradient of φ.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum GradientMode {
    /// As its sensor measures it (Section IV).
    Measured,
    /// A fixed magnitude, per meter, towards the stimulus (Section V).
    Fixed(f64),
}

/// How to close a cell that neighbors and walls leave open (Section V.B, Fig. 6).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Closure {
    /// Base of the isosceles triangle for a single bearing.
    pub triangle_base: Meters,
    /// Height of that triangle.
    pub triangle_height: Meters,
    /// Distance of the line that closes a gap of π or more.
    pub close_distance: Meters,
    /// Apothem of the regular 24-gon that every cell is cut to, if any.
    pub cap: Option<Meters>,
}

/// Parameters of a robot's controller.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ControllerSetup {
    /// Control law.
    pub law: Law,
    /// Gain k of eq. 8, per second.
    pub gain_per_s: f64,
    /// Cap on the commanded speed, if any.
    pub speed_cap: Option<MetersPerSecond>,
    /// Source of the gradient.
    pub gradient: GradientMode,
    /// Closing rules.
    pub closure: Closure,
    /// A neighbor counts while it was heard less than this many ticks ago; at least 1.
    pub neighbor_timeout_ticks: u32,
}

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
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
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
    /// Parameters of the controller.
    pub controller: ControllerSetup,
    /// The arena's namespace of process numbers, if it is known (`transport::pid_namespace`).
    pub pid_namespace: Option<u64>,
}

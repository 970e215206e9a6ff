//! Messages between arena and supervisor: one JSON object per line, over the arena's standard
//! input and output. If the supervisor dies, the arena reads the end of its input and ends the run.

use serde::{Deserialize, Serialize};

use protocol::robot_id::RobotId;

/// From the arena to its supervisor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Event {
    /// The services stand: agents may come.
    Ready,
    /// Start another life of this robot.
    Start(RobotId),
    /// This life of the robot is over for the arena: end its process, if it is yours.
    End(RobotId),
    /// The plan pauses this life of the robot: stop its process, if it is yours.
    Stop(RobotId),
    /// The pause is over: let its process go on, if it is yours.
    Continue(RobotId),
    /// How far the run is, for a supervisor that shows it.
    Progress {
        /// Ticks done.
        position: u64,
        /// Ticks in all.
        total: u64,
        /// Further text to show.
        text: String,
    },
    /// The run is over; this is its `summary.json`.
    Summary(String),
    /// A trial of a batch is over; this is its record, as JSON.
    Record(String),
    /// There is no summary, for this reason.
    Failed(String),
}

/// From the supervisor to its arena.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Order {
    /// Play another trial by the same agents: the scenario, resolved.
    Trial(String),
    /// End the run at the next tick and write what there is.
    Stop,
    /// An agent's process has ended, or none could be started.
    Lost {
        /// The robot, and its life.
        id: RobotId,
        /// The process; `None` if it could not be started.
        pid: Option<u32>,
        /// How it ended, such as `exit status 1` or `signal 9`, or why it could not be started.
        how: String,
    },
}

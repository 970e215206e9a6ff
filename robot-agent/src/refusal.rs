//! Parameters that a controller refuses.

use protocol::robot_id::RobotId;

/// A controller does not take its parameters.
#[derive(Debug, thiserror::Error)]
#[error("{id}: {program} refuses its params: {reason}")]
pub(crate) struct Refusal {
    pub(crate) id: RobotId,
    /// Path of the program.
    pub(crate) program: String,
    /// In the controller's own words.
    pub(crate) reason: String,
}

//! Reasons for which a program does not join that are mostly the same for all its robots.

use protocol::robot_id::RobotId;

/// A program does not join.
#[derive(Debug, thiserror::Error)]
#[error("{id}: {program} {what}: {reason}")]
pub(crate) struct Refusal {
    pub(crate) id: RobotId,
    /// Path of the program, or what else its controller is called.
    pub(crate) program: String,
    /// The verb of the sentence, such as `refuses its params`.
    pub(crate) what: &'static str,
    /// In the words of whoever found it.
    pub(crate) reason: String,
}

impl Refusal {
    /// Of this program for robot `id`.
    pub(crate) fn new(id: RobotId, program: &str, what: &'static str, reason: impl ToString) -> Self {
        Self { id, program: program.into(), what, reason: reason.to_string() }
    }
}

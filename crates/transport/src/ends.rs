//! The two ends of one robot's services: what carries percepts to its agent, and commands back to the arena.

use protocol::{
    command::Answer,
    percept::{Percept, Tick},
    robot_id::RobotId,
};

use crate::{
    frame_cache::Frames,
    raw::{CommandError, PerceptError, RawCommand},
};

/// A failure of the transport, with what was being done.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ServiceError {
    /// Another agent drives this robot, or has driven it and not been replaced.
    #[error("{0} already has an agent")]
    Taken(RobotId),
    /// The arena does not know this robot, or this life of it.
    #[error("the run has no place for {0}")]
    Unknown(RobotId),
    /// Everything else.
    #[error("cannot {doing}: {reason}")]
    Transport {
        /// Operation that failed.
        doing: String,
        /// Reason that the transport gave.
        reason: String,
    },
}

/// The arena's end.
pub trait ArenaEnd {
    /// Sends one tick's percept, with the frames of its packets from `frames`.
    fn send(&mut self, percept: &Percept, frames: &mut Frames) -> Result<(), ServiceError>;

    /// The next unread command, as it came.
    fn receive(&mut self) -> Result<Option<RawCommand>, ServiceError>;

    /// The notes that came with the command that was received last.
    fn notes(&self) -> &[f64];

    /// Checks the command that was received last: whether it is of life `expected`, and answers `tick`. The frame of its
    /// packet goes to `frames`, for those who will hear it.
    fn check(
        &self,
        command: &RawCommand,
        expected: RobotId,
        tick: Tick,
        frames: &mut Frames,
    ) -> Result<Answer, CommandError>;
}

/// An agent's end.
pub trait AgentEnd {
    /// Writes the next unread percept to `percept`; returns how many of its deliveries did not decode, or
    /// why the percept is refused. `None` if there is no unread one.
    fn receive(&mut self, percept: &mut Percept) -> Result<Option<Result<u32, PerceptError>>, ServiceError>;

    /// Sends a command, whose packet is in `frame`, with up to [`NOTES_MAX`](protocol::notes::NOTES_MAX) notes.
    fn send(&mut self, command: RawCommand, frame: &[u8], notes: &[f64]) -> Result<(), ServiceError>;
}

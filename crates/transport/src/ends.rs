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
    fn receive(&mut self) -> Result<Option<Received<'_>>, ServiceError>;
}

/// A command as it came, with what does not lie in it: nothing of it is believed yet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Received<'a> {
    /// The command.
    pub command: &'a RawCommand,
    /// Bytes that begin with its frame, if that is long.
    pub frame: &'a [u8],
    /// Its notes.
    pub notes: &'a [f64],
    /// Longest payload that is accepted, bytes.
    pub payload_bytes_max: usize,
}

impl Received<'_> {
    /// Checks whether the command is in order, of life `expected`, and answers `tick`. The frame of its packet goes to
    /// `frames`, for those who will hear it.
    pub fn check(&self, expected: RobotId, tick: Tick, frames: &mut Frames) -> Result<Answer, CommandError> {
        let answer = self.command.check(self.frame, self.payload_bytes_max, expected, tick)?;
        frames.keep(&answer.packet(), &self.command.frame, self.frame);
        Ok(answer)
    }
}

/// An agent's end.
pub trait AgentEnd {
    /// Writes the next unread percept to `percept`; returns how many of its deliveries did not decode, or
    /// why the percept is refused. `None` if there is no unread one.
    fn receive(&mut self, percept: &mut Percept) -> Result<Option<Result<u32, PerceptError>>, ServiceError>;

    /// Sends a command, whose packet is in `frame`, with up to [`NOTES_MAX`](protocol::notes::NOTES_MAX) notes.
    fn send(&mut self, command: RawCommand, frame: &[u8], notes: &[f64]) -> Result<(), ServiceError>;
}

//! All that an agent answers in one tick.

use crate::{
    frame::BodyVector,
    packet::{Packet, PacketView},
    payload::{Payload, PayloadOverLimit},
    robot_id::RobotId,
};

/// Where to go and what to say next: what a controller decides.
#[derive(Clone, Debug, PartialEq)]
pub struct Command {
    /// The estimated error ê = Ĉ − p (m, body frame): how far the robot believes to be from its goal.
    /// `None` if it has no goal: it has sensed nothing yet, or has no cell, or none with mass. That is no error of
    /// zero: whoever is lost has not converged.
    pub estimated_error: Option<BodyVector>,
    /// The velocity u = k(Ĉ − p), capped (eq. 8; m/s, body frame). A holonomic body moves with it.
    pub velocity: BodyVector,
    /// The payload of the packet to transmit next.
    pub payload: Payload,
}

/// Largest component of an estimated error (m) or velocity (m/s) that is carried out. An honest robot stays far
/// below: a cell that a gap just under π leaves open reaches some 1e9 m.
pub const REASON: f64 = 1e12;

/// A vector that is no number, or beyond all reason.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("its {what} is ({x}, {y}), not within ±{REASON:e}")]
pub struct Unreasonable {
    /// `estimated error` or `velocity`.
    pub what: &'static str,
    /// Its x.
    pub x: f64,
    /// Its y.
    pub y: f64,
}

/// Why a command is not carried out, whoever plays the robot.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Refusal {
    /// NaN, or beyond all reason.
    #[error(transparent)]
    Vector(#[from] Unreasonable),
    /// Its packet says more than the scenario allows.
    #[error(transparent)]
    Payload(#[from] PayloadOverLimit),
}

/// Returns a vector that can be carried out.
pub fn within_reason(what: &'static str, vector: BodyVector) -> Result<BodyVector, Unreasonable> {
    let (x, y) = (vector.0.x, vector.0.y);
    let is_reasonable = x.abs() <= REASON && y.abs() <= REASON;
    is_reasonable.then_some(vector).ok_or(Unreasonable { what, x, y })
}

impl Command {
    /// Checks that it can be carried out where payloads have up to so many bytes: the same in every engine, or their
    /// digests would differ.
    pub fn check(&self, payload_bytes_max: usize) -> Result<(), Refusal> {
        self.estimated_error.map_or(Ok(BodyVector::HERE), |error| within_reason("estimated error", error))?;
        within_reason("velocity", self.velocity)?;
        let length = self.payload.len();
        match length > payload_bytes_max {
            true => Err(PayloadOverLimit { length, limit: payload_bytes_max }.into()),
            false => Ok(()),
        }
    }

    /// Stands still and says nothing but that the robot is there.
    pub const REST: Self =
        Self { estimated_error: None, velocity: BodyVector::HERE, payload: Payload::EMPTY };
}

/// A command with the header of its packet, as it reaches the arena.
///
/// A controller does not write headers: its host names the robot and numbers its packets ([`Transmitter`]).
#[derive(Clone, Debug, PartialEq)]
pub struct Answer {
    /// The robot that gives the command and sends the packet.
    pub sender: RobotId,
    /// Number of the packet.
    pub sequence: u32,
    /// The command.
    pub command: Command,
}

impl Answer {
    /// The packet without its payload: whose it is, and which.
    #[inline]
    pub fn header(&self) -> Packet {
        Packet::short(self.sender, self.sequence, None)
    }

    /// The packet to transmit next.
    #[inline]
    pub fn packet(&self) -> PacketView<'_> {
        PacketView { sender: self.sender, sequence: self.sequence, payload: &self.command.payload }
    }
}

/// Numbers the packets of one life of a robot, from 0 on.
#[derive(Clone, Debug)]
pub struct Transmitter {
    sender: RobotId,
    sequence: u32,
}

impl Transmitter {
    /// The transmitter of a robot that has just booted.
    pub fn new(sender: RobotId) -> Self {
        Self { sender, sequence: 0 }
    }

    /// Returns `command` as the robot's answer, with the next packet.
    #[inline]
    pub fn answer(&mut self, command: Command) -> Answer {
        let sequence = self.sequence;
        self.sequence = sequence.wrapping_add(1);
        Answer { sender: self.sender, sequence, command }
    }
}

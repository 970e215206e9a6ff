//! All that an agent answers in one tick.

use crate::{
    frame::BodyVector,
    packet::{Packet, PacketView},
    payload::Payload,
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

impl Command {
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

//! One cycle of one agent, stage by stage.

use protocol::{packet::Packet, percept::Tick};

/// Parts of an agent's cycle, in their order. All but the first add up to the whole cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// From the ring of the doorbell, or from the timer's deadline, until the agent runs.
    Wake,
    /// The percept is read and checked.
    Receive,
    /// Deliveries are put into the neighbor table.
    Neighbors,
    /// The local cell is cut and closed.
    Cell,
    /// φ̂ is estimated and the cell is cut to V+.
    Truncation,
    /// Mass and centroid are integrated.
    Centroid,
    /// The rest of the controller's step: all of it where it tells of no stages.
    Step,
    /// The command is sent.
    Publish,
}

impl Stage {
    /// All stages, in their order.
    pub const ALL: [Self; 8] = [
        Self::Wake,
        Self::Receive,
        Self::Neighbors,
        Self::Cell,
        Self::Truncation,
        Self::Centroid,
        Self::Step,
        Self::Publish,
    ];

    /// As outputs spell it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Wake => "wake",
            Self::Receive => "receive",
            Self::Neighbors => "neighbors",
            Self::Cell => "cell",
            Self::Truncation => "truncation",
            Self::Centroid => "centroid",
            Self::Step => "step",
            Self::Publish => "publish",
        }
    }
}

/// One cycle of one agent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CycleTimes {
    /// Index of the robot.
    pub robot: u32,
    /// The tick whose percept it answered.
    pub tick: Tick,
    /// When it woke up: nanoseconds since all agents had joined.
    pub woke_ns: u64,
    /// Length of each [`Stage`], nanoseconds; the largest `u32` stands for more than that.
    pub stages_ns: [u32; Stage::ALL.len()],
    /// The packet that it ended with, where it is known: of robots whose cycles are asked for one by one.
    pub packet: Option<PacketNumber>,
}

/// A packet as its sender numbers it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PacketNumber {
    /// The life of the sender.
    pub incarnation: u16,
    /// Number of the packet in it.
    pub sequence: u32,
}

impl PacketNumber {
    /// Of `packet`.
    pub fn of(packet: &Packet) -> Self {
        Self { incarnation: packet.sender().incarnation, sequence: packet.sequence() }
    }
}

impl CycleTimes {
    /// Length of one stage, nanoseconds.
    pub fn stage_ns(&self, stage: Stage) -> u32 {
        self.stages_ns[stage as usize]
    }

    /// From the agent's wake-up until its command was sent, nanoseconds.
    pub fn cycle_ns(&self) -> u64 {
        self.stages_ns[Stage::Receive as usize..].iter().map(|&ns| u64::from(ns)).sum()
    }
}

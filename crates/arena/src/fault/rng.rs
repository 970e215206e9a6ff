//! Where a fault's random draws come from: each fault of a plan has draws of its own.

use protocol::percept::Tick;

use crate::{
    channel::Reception,
    random::{Draws, Purpose},
};

/// One fault's source of random draws.
#[derive(Clone, Copy, Debug)]
pub(super) struct FaultRng {
    pub(super) seed: u64,
    /// Index of the fault in the plan.
    pub(super) fault: u32,
    /// Which copy of a packet it is drawn for; 0 for the packet itself.
    pub(super) copy: u32,
}

impl FaultRng {
    /// The same source for another copy of a packet.
    pub(super) fn of_copy(self, copy: u32) -> Self {
        Self { copy, ..self }
    }

    /// The draws for one packet on one link.
    pub(super) fn of(self, reception: &Reception) -> Draws {
        let Reception { sender, receiver, number, .. } = *reception;
        Draws::of_fault(self.salt(), self.seed, Purpose::FaultPacket, number, sender, receiver)
    }

    /// The draws for one reading of one robot.
    pub(super) fn of_reading(self, tick: Tick, robot: u32) -> Draws {
        Draws::of_fault(self.fault, self.seed, Purpose::FaultReading, tick, robot, 0)
    }

    /// The draws for whether a robot is chosen; `which` tells choices of one fault apart.
    pub(super) fn of_choice(self, robot: u32, which: u32) -> Draws {
        Draws::of_fault(self.fault, self.seed, Purpose::FaultChoice, 0, robot, which)
    }

    /// Tells copies of one fault apart: a plan has fewer than 2^24 faults.
    fn salt(self) -> u32 {
        self.copy << 24 | self.fault
    }
}

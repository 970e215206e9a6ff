//! What a kind of fault can do. Each kind does one or two of these things and leaves the rest.

use std::fmt::Debug;

use protocol::{
    frame::BodyVector,
    packet::Packet,
    percept::{Light, Tick},
};

use super::{Presence, Strike, choice::Choice, ledger::Line};
use crate::{
    channel::Reception,
    frame::{ArenaPoint, Pose},
    random::{Draws, Purpose},
};

/// The world as a fault finds it when it begins.
#[derive(Clone, Copy, Debug)]
pub struct Scene<'a> {
    /// The tick.
    pub tick: Tick,
    /// Where every body is.
    pub poses: &'a [Pose],
    /// Where lamps hang.
    pub lamps: &'a [ArenaPoint],
}

/// A packet on its way to one receiver.
#[derive(Clone, Copy, Debug)]
pub struct Flight {
    /// From whom, to whom, and what it says by now.
    pub reception: Reception,
    /// Where the receiver is.
    pub receiver_at: ArenaPoint,
}

/// What a fault does to a packet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Verdict {
    /// Nothing.
    Pass,
    /// It is lost; the words say how, for the ledger.
    Drop(&'static str),
    /// It comes so many ticks later.
    Delay(Tick),
    /// It comes again so many ticks later.
    Repeat(Tick),
    /// It arrives as another one.
    Alter(Packet),
}

impl Verdict {
    /// What the ledger says of it.
    pub(super) fn entry(&self) -> Option<&'static str> {
        match self {
            Self::Pass => None,
            Self::Drop(how) => Some(how),
            Self::Delay(_) => Some("packets delayed"),
            Self::Repeat(_) => Some("packets duplicated"),
            Self::Alter(_) => Some("packets altered unnoticed"),
        }
    }
}

/// One fault's source of random draws.
#[derive(Clone, Copy, Debug)]
pub(super) struct Luck {
    pub(super) seed: u64,
    /// Index of the fault in the plan.
    pub(super) fault: u32,
}

impl Luck {
    /// The draws for one packet on one link.
    pub(super) fn of(self, reception: &Reception) -> Draws {
        let Reception { sender, receiver, number, .. } = *reception;
        Draws::of_fault(self.fault, self.seed, Purpose::FaultPacket, number, sender, receiver)
    }

    /// The draws for one reading of one robot.
    pub(super) fn of_reading(self, tick: Tick, robot: u32) -> Draws {
        Draws::of_fault(self.fault, self.seed, Purpose::FaultReading, tick, robot, 0)
    }

    /// The draws for whether a robot is chosen; `which` tells choices of one fault apart.
    pub(super) fn of_choice(self, robot: u32, which: u32) -> Draws {
        Draws::of_fault(self.fault, self.seed, Purpose::FaultChoice, 0, robot, which)
    }
}

/// A kind of fault with its parameters and its memory.
pub(super) trait Rule: Debug {
    /// It is about to begin, and looks at the world.
    fn look(&mut self, _: &Scene<'_>) {}

    /// It begins: what it does to agents at once.
    fn begin(&mut self, _: Tick, _: &Choice, _: &mut [Presence], _: &mut Vec<Strike>, _: &mut Line) {}

    /// It ends: what it does to agents then.
    fn end(&mut self, _: Luck, _: &mut [Presence], _: &mut Vec<Strike>, _: &mut Line) {}

    /// Whether it looks at all packets and chooses by itself.
    fn chooses_itself(&self) -> bool {
        false
    }

    /// Judges a packet on its way.
    fn judge(&mut self, _: &Flight, _: Luck) -> Verdict {
        Verdict::Pass
    }

    /// Changes what a chosen robot says; whether it did.
    fn speak(&mut self, _: &mut Packet) -> bool {
        false
    }

    /// Changes what a chosen robot senses; whether it did.
    fn sense(&mut self, _: Tick, _robot: u32, _: Luck, _: &mut Light) -> bool {
        false
    }

    /// Changes how a chosen robot moves; whether it did.
    fn drive(&mut self, _: &mut BodyVector) -> bool {
        false
    }

    /// By how many ticks a chosen robot answers late.
    fn lateness(&self) -> Tick {
        0
    }
}

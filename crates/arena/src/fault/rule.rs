//! The trait of every kind of fault. Each kind overrides a few of its methods and leaves the rest.

use std::fmt::Debug;

use protocol::{
    frame::BodyVector,
    packet::Packet,
    percept::{Light, Tick},
};

use super::{
    fate::Fate,
    ledger::Entry,
    rng::FaultRng,
    target::{Scene, Target},
};
use crate::{channel::Reception, field::Field, frame::ArenaPoint, payloads::Payloads};
use scenario::ProcessFault;

/// A packet on its way to one receiver.
#[derive(Clone, Copy, Debug)]
pub(super) struct Flight {
    /// From whom, to whom, and what it says by now.
    pub(super) reception: Reception,
    /// Where the receiver is.
    pub(super) receiver_at: ArenaPoint,
}

/// Effect of a fault on a packet.
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
    /// Returns its entry in the ledger.
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

/// A kind of fault with its parameters and its memory.
pub(super) trait Rule: Debug {
    /// It is about to begin, and looks at the world.
    fn look(&mut self, _: &Scene<'_>) {}

    /// It begins: what it does to agents at once.
    fn begin(&mut self, _: Tick, _: &Target, _: &mut [Fate], _: &mut Vec<ProcessFault>, _: &mut Entry) {}

    /// It begins: what it does to the field; whether it is another one then.
    fn change_field(&self, _: &mut Field) -> bool {
        false
    }

    /// It ends: what it does to agents then.
    fn end(&mut self, _: FaultRng, _: &mut [Fate], _: &mut Vec<ProcessFault>, _: &mut Entry) {}

    /// Whether it looks at all packets and chooses by itself.
    fn chooses_itself(&self) -> bool {
        false
    }

    /// Judges a packet on its way, whose payload is among `payloads`.
    fn judge(&mut self, _: &Flight, _: FaultRng, _: &mut Payloads) -> Verdict {
        Verdict::Pass
    }

    /// Changes what a chosen robot says; whether it did.
    fn speak(&mut self, _: &mut Packet, _: &mut Payloads) -> bool {
        false
    }

    /// Changes what a chosen robot senses; whether it did.
    fn sense(&mut self, _: Tick, _robot: u32, _: FaultRng, _: &mut Light) -> bool {
        false
    }

    /// Changes how a chosen robot moves, `None` for not at all and not for others either; whether it did.
    fn drive(&mut self, _: &mut Option<BodyVector>) -> bool {
        false
    }

    /// By how many ticks a chosen robot answers late.
    fn lateness(&self) -> Tick {
        0
    }
}

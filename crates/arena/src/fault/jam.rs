//! `jam`: nobody inside a disc hears anything.

use super::{
    rng::FaultRng,
    rule::{Flight, Rule, Verdict},
};
use crate::frame::ArenaPoint;
use crate::payloads::Payloads;
use scenario::{Disc, FaultSpec};

#[derive(Debug)]
pub(super) struct Jam {
    disc: Option<Disc>,
}

impl Jam {
    pub(super) fn new(spec: &FaultSpec) -> Self {
        Self { disc: spec.region }
    }
}

impl Rule for Jam {
    fn chooses_itself(&self) -> bool {
        true
    }

    fn judge(&mut self, flight: &Flight, _: FaultRng, _: &mut Payloads) -> Verdict {
        let jammed = self.disc.is_some_and(|Disc { center_m, radius_m }| {
            (flight.receiver_at - ArenaPoint::from(center_m.get())).norm() <= radius_m.get()
        });
        if jammed { Verdict::Drop("packets jammed") } else { Verdict::Pass }
    }
}

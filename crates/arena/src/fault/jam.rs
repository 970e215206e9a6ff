//! `jam`: nobody inside a disc hears anything.

use super::{
    rng::FaultRng,
    rule::{Flight, Rule, Verdict},
    target::covers,
};
use crate::payloads::Payloads;
use scenario::{
    Scenario,
    fault::{self, Disc},
};

#[derive(Debug)]
pub(super) struct Jam {
    disc: Disc,
}

impl Jam {
    pub(super) fn new(spec: &fault::Jam, _: &Scenario) -> Self {
        Self { disc: spec.region }
    }
}

impl Rule for Jam {
    fn chooses_itself(&self) -> bool {
        true
    }

    fn judge(&mut self, flight: &Flight, _: FaultRng, _: &mut Payloads) -> Verdict {
        if covers(&self.disc, &flight.receiver_at) { Verdict::Drop("packets jammed") } else { Verdict::Pass }
    }
}

//! `loss`: each packet is lost by its own chance.

use super::{
    rng::FaultRng,
    rule::{Flight, Rule, Verdict},
};
use crate::payloads::Payloads;
use scenario::{Scenario, fault};

#[derive(Debug)]
pub(super) struct Loss {
    probability: f64,
}

impl Loss {
    pub(super) fn new(spec: &fault::Loss, _: &Scenario) -> Self {
        Self { probability: spec.probability.get() }
    }
}

impl Rule for Loss {
    fn judge(&mut self, flight: &Flight, rng: FaultRng, _: &mut Payloads) -> Verdict {
        match rng.of(&flight.reception).chance(self.probability) {
            true => Verdict::Drop("packets dropped"),
            false => Verdict::Pass,
        }
    }
}

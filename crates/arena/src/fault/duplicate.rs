//! `duplicate`: packets come twice, the second time perhaps later.

use protocol::percept::Tick;

use super::{
    rng::FaultRng,
    rule::{Flight, Rule, Verdict},
};
use crate::payloads::Payloads;
use scenario::{Scenario, fault};

#[derive(Debug)]
pub(super) struct Duplicate {
    probability: f64,
    delay: Tick,
}

impl Duplicate {
    pub(super) fn new(spec: &fault::Duplicate, scenario: &Scenario) -> Self {
        Self { probability: spec.probability.get(), delay: scenario.tick_at(spec.delay_s.get()) }
    }
}

impl Rule for Duplicate {
    fn judge(&mut self, flight: &Flight, rng: FaultRng, _: &mut Payloads) -> Verdict {
        match rng.of(&flight.reception).chance(self.probability) {
            true => Verdict::Repeat(self.delay),
            false => Verdict::Pass,
        }
    }
}

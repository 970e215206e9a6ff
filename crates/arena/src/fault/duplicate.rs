//! `duplicate`: packets come twice, the second time perhaps later.

use protocol::percept::Tick;

use super::{
    rng::FaultRng,
    rule::{Flight, Rule, Verdict},
};
use crate::payloads::Payloads;
use scenario::{FaultSpec, Scenario};

#[derive(Debug)]
pub(super) struct Duplicate {
    probability: f64,
    delay: Tick,
}

impl Duplicate {
    pub(super) fn new(spec: &FaultSpec, scenario: &Scenario) -> Self {
        Self {
            probability: spec.probability.map_or(0.0, |probability| probability.get()),
            delay: spec.delay_s.map_or(0, |delay| scenario.tick_at(delay.get())),
        }
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

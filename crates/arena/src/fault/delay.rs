//! `delay`: packets come late; with jitter they may overtake each other.

use protocol::percept::Tick;

use super::{
    rng::FaultRng,
    rule::{Flight, Rule, Verdict},
};
use crate::payloads::Payloads;
use scenario::{Scenario, fault};

#[derive(Debug)]
pub(super) struct Delay {
    delay_s: f64,
    jitter_s: f64,
    step_s: f64,
}

impl Delay {
    pub(super) fn new(spec: &fault::Delay, scenario: &Scenario) -> Self {
        Self { delay_s: spec.delay_s.get(), jitter_s: spec.jitter_s.get(), step_s: scenario.step_s.get() }
    }
}

impl Rule for Delay {
    fn judge(&mut self, flight: &Flight, rng: FaultRng, _: &mut Payloads) -> Verdict {
        let late_s = self.delay_s + self.jitter_s * rng.of(&flight.reception).unit();
        Verdict::Delay((late_s / self.step_s).round() as Tick)
    }
}

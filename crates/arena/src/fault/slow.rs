//! `slow`: agents answer late; until then their last command stands.

use protocol::percept::Tick;

use super::rule::Rule;
use scenario::{FaultSpec, Scenario};

#[derive(Debug)]
pub(super) struct Slow {
    late: Tick,
}

impl Slow {
    pub(super) fn new(spec: &FaultSpec, scenario: &Scenario) -> Self {
        Self { late: spec.delay_s.map_or(0, |delay| scenario.tick_at(delay.get())) }
    }
}

impl Rule for Slow {
    fn lateness(&self) -> Tick {
        self.late
    }
}

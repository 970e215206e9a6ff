//! `slow`: agents answer late; until then their last command stands.

use protocol::percept::Tick;

use super::rule::Rule;
use scenario::{Scenario, fault};

#[derive(Debug)]
pub(super) struct Slow {
    late: Tick,
}

impl Slow {
    pub(super) fn new(spec: &fault::Slow, scenario: &Scenario) -> Self {
        Self { late: scenario.tick_at(spec.delay_s.get()) }
    }
}

impl Rule for Slow {
    fn lateness(&self) -> Tick {
        self.late
    }
}

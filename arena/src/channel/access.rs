//! When robots transmit: one packet per neighbor cycle, at a time that depends on the scheme.
//!
//! Times are seconds since tick 0; cycles begin before it, so that at tick 0 robots have been
//! talking for a whole cycle already.

use crate::{
    random::{Draws, Purpose},
    scenario::{Access, Scenario},
};

/// Cycles before tick 0 that are numbered: the first packets begin in the second of them.
const CYCLES_BEFORE: f64 = 2.0;

/// A scheme with its parameters.
#[derive(Clone, Debug)]
pub(super) struct Schedule {
    access: Access,
    cycle_s: f64,
    /// Part of the cycle in which packets may start.
    window_s: f64,
    slots: u32,
    jitter_s: f64,
    seed: u64,
}

impl Schedule {
    pub(super) fn new(scenario: &Scenario) -> Self {
        let channel = &scenario.channel;
        let cycle_s = scenario.cycle_s();
        Self {
            access: channel.access.unwrap_or(Access::Instant),
            cycle_s,
            window_s: cycle_s - channel.guard_s.map_or(0.0, |guard| guard.get()),
            slots: channel.slots.map_or(1, |slots| slots.get()),
            jitter_s: channel.jitter_s.map_or(0.0, |jitter| jitter.get()),
            seed: scenario.seed.get(),
        }
    }

    /// When packet `number` of `sender` begins. Later numbers begin later.
    pub(super) fn start_s(&self, sender: u32, number: u64) -> f64 {
        let cycle_s = (number as f64 - CYCLES_BEFORE) * self.cycle_s;
        let mut draws = Draws::of(self.seed, Purpose::Transmission, number, sender, 0);
        cycle_s
            + match self.access {
                Access::Instant => 0.0,
                Access::Random => self.phase_s(sender) + self.window_s * draws.unit(),
                Access::Aligned => self.window_s * draws.unit(),
                Access::Slotted => {
                    self.cycle_s * (f64::from(draws.below(self.slots)) / f64::from(self.slots))
                }
                Access::FixedPhase => self.phase_s(sender) + self.jitter_s * (draws.unit() - 0.5),
            }
    }

    /// Where a robot's own cycle begins.
    fn phase_s(&self, sender: u32) -> f64 {
        self.cycle_s * Draws::of(self.seed, Purpose::Phase, 0, sender, 0).unit()
    }
}

//! `sensor`: light sensors read too much, noise, or always the same.

use std::collections::BTreeMap;

use protocol::percept::{Light, Tick};

use super::{rng::FaultRng, rule::Rule};
use scenario::{Scenario, fault};

#[derive(Debug)]
pub(super) struct Sensor {
    spec: fault::Sensor,
    /// First reading of each stuck sensor.
    first: BTreeMap<u32, Light>,
}

impl Sensor {
    pub(super) fn new(spec: &fault::Sensor, _: &Scenario) -> Self {
        Self { spec: spec.clone(), first: BTreeMap::new() }
    }
}

impl Rule for Sensor {
    fn sense(&mut self, tick: Tick, robot: u32, rng: FaultRng, light: &mut Light) -> bool {
        if self.spec.stuck {
            *light = *self.first.entry(robot).or_insert(*light);
        }
        if let Some(bias) = self.spec.bias_counts {
            light.value += bias.get();
        }
        if let Some(noise) = self.spec.noise_counts {
            light.value += noise.get() * rng.of_reading(tick, robot).normal();
        }
        true
    }
}

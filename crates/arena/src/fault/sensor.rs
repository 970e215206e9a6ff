//! `sensor`: light sensors read too much, noise, or always the same.

use std::collections::BTreeMap;

use protocol::percept::{Light, Tick};

use super::{rng::FaultRng, rule::Rule};
use scenario::FaultSpec;

#[derive(Debug)]
pub(super) struct Sensor {
    bias_counts: f64,
    noise_counts: f64,
    stuck: bool,
    /// First reading of each stuck sensor.
    first: BTreeMap<u32, Light>,
}

impl Sensor {
    pub(super) fn new(spec: &FaultSpec) -> Self {
        Self {
            bias_counts: spec.bias_counts.map_or(0.0, |bias| bias.get()),
            noise_counts: spec.noise_counts.map_or(0.0, |noise| noise.get()),
            stuck: spec.stuck == Some(true),
            first: BTreeMap::new(),
        }
    }
}

impl Rule for Sensor {
    fn sense(&mut self, tick: Tick, robot: u32, rng: FaultRng, light: &mut Light) -> bool {
        if self.stuck {
            *light = *self.first.entry(robot).or_insert(*light);
        }
        light.value += self.bias_counts;
        if self.noise_counts > 0.0 {
            light.value += self.noise_counts * rng.of_reading(tick, robot).normal();
        }
        true
    }
}

//! `[light]`: what a robot senses the light with.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::number::{DiodeCount, NonNegative, Positive};

/// The light sensor of every robot.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct LightSpec {
    /// The kind of sensor.
    pub sensor: LightSensor,
    /// Photodiodes around the body, the first straight ahead; default 8. This and all below with
    /// `sensor = "ring"` and only there.
    pub diodes: Option<DiodeCount>,
    /// Height in meters of the lamps above the diodes; default 0.3.
    pub height_m: Option<Positive>,
    /// Standard deviation of a diode's gain, as a share of it, drawn once per diode; default 0.
    pub gain_mismatch: Option<NonNegative>,
    /// Standard deviation of each reading of a diode, counts; default 0.
    pub noise_counts: Option<NonNegative>,
    /// Largest reading of the converter, counts, at which it saturates; default 1023.
    pub adc_max_counts: Option<Positive>,
    /// Step of the converter, counts; default 1.
    pub adc_step_counts: Option<Positive>,
}

/// The kind of light sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum LightSensor {
    /// φ and its direction as they are.
    #[default]
    Ideal,
    /// A ring of photodiodes facing outward: bearing and strength from the sum of their readings.
    Ring,
}

impl LightSpec {
    /// The same with every key that has a meaning written out.
    pub(super) fn filled(mut self) -> Self {
        if self.sensor == LightSensor::Ring {
            self.diodes.get_or_insert(constant!(DiodeCount, 8));
            self.height_m.get_or_insert(constant!(Positive, 0.3));
            self.gain_mismatch.get_or_insert(constant!(NonNegative, 0.0));
            self.noise_counts.get_or_insert(constant!(NonNegative, 0.0));
            self.adc_max_counts.get_or_insert(constant!(Positive, 1023.0));
            self.adc_step_counts.get_or_insert(constant!(Positive, 1.0));
        }
        self
    }

    /// The keys given here that mean nothing without a ring.
    pub(super) fn meaningless_without_ring(&self) -> impl Iterator<Item = &'static str> {
        let ring = self.sensor == LightSensor::Ring;
        [
            ("diodes", self.diodes.is_some()),
            ("height_m", self.height_m.is_some()),
            ("gain_mismatch", self.gain_mismatch.is_some()),
            ("noise_counts", self.noise_counts.is_some()),
            ("adc_max_counts", self.adc_max_counts.is_some()),
            ("adc_step_counts", self.adc_step_counts.is_some()),
        ]
        .into_iter()
        .filter_map(move |(key, given)| (given && !ring).then_some(key))
    }
}

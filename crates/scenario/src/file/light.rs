//! `[light]`: what a robot senses the light with.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::choice::without_meaning;
use crate::light::{LightSpec, RingSpec};
use crate::number::{DiodeCount, NonNegative, Positive};
use crate::problem::Problem;

/// The light sensor of every robot.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct LightKeys {
    /// The kind of sensor.
    pub(crate) sensor: LightSensor,
    /// Photodiodes around the body, the first straight ahead; default 8. This and all below with
    /// `sensor = "ring"` and only there.
    pub(crate) diodes: Option<DiodeCount>,
    /// Height in meters of the lamps above the diodes; default 0.3.
    pub(crate) height_m: Option<Positive>,
    /// Standard deviation of a diode's gain, as a share of it, drawn once per diode; default 0.
    pub(crate) gain_mismatch: Option<NonNegative>,
    /// Standard deviation of each reading of a diode, counts; default 0.
    pub(crate) noise_counts: Option<NonNegative>,
    /// Largest reading of the converter, counts, at which it saturates; default 1023.
    pub(crate) adc_max_counts: Option<Positive>,
    /// Step of the converter, counts; default 1.
    pub(crate) adc_step_counts: Option<Positive>,
}

/// The kind of light sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum LightSensor {
    /// φ and its direction as they are.
    #[default]
    Ideal,
    /// A ring of photodiodes facing outward: bearing and strength from the sum of their readings.
    Ring,
}

impl LightKeys {
    /// The sensor with all its parameters.
    pub(crate) fn resolve(self) -> Result<LightSpec, Problem> {
        if self.sensor == LightSensor::Ring {
            return Ok(LightSpec::Ring(RingSpec {
                diodes: self.diodes.unwrap_or(constant!(DiodeCount, 8)),
                height_m: self.height_m.unwrap_or(constant!(Positive, 0.3)),
                gain_mismatch: self.gain_mismatch.unwrap_or(constant!(NonNegative, 0.0)),
                noise_counts: self.noise_counts.unwrap_or(constant!(NonNegative, 0.0)),
                adc_max_counts: self.adc_max_counts.unwrap_or(constant!(Positive, 1023.0)),
                adc_step_counts: self.adc_step_counts.unwrap_or(constant!(Positive, 1.0)),
            }));
        }
        let of_a_ring = [
            ("diodes", self.diodes.is_some()),
            ("height_m", self.height_m.is_some()),
            ("gain_mismatch", self.gain_mismatch.is_some()),
            ("noise_counts", self.noise_counts.is_some()),
            ("adc_max_counts", self.adc_max_counts.is_some()),
            ("adc_step_counts", self.adc_step_counts.is_some()),
        ];
        match of_a_ring.into_iter().find(|(_, given)| *given) {
            Some((key, _)) => Err(without_meaning(&format!("light.{key}"), "light.sensor", "ideal")),
            None => Ok(LightSpec::Ideal),
        }
    }
}

impl From<LightSpec> for LightKeys {
    fn from(light: LightSpec) -> Self {
        let LightSpec::Ring(ring) = light else { return Self::default() };
        Self {
            sensor: LightSensor::Ring,
            diodes: Some(ring.diodes),
            height_m: Some(ring.height_m),
            gain_mismatch: Some(ring.gain_mismatch),
            noise_counts: Some(ring.noise_counts),
            adc_max_counts: Some(ring.adc_max_counts),
            adc_step_counts: Some(ring.adc_step_counts),
        }
    }
}

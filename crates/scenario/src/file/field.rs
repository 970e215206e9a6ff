//! `[field]`: the sensory function φ.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::number::{Finite, Positive, Xy};

/// The sensory function φ: a constant plus Gaussians plus lamps.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct FieldSpec {
    /// The constant Φ.
    pub offset: Finite,
    /// Gaussians of eq. 19 and 20.
    pub gaussian: Vec<GaussianSpec>,
    /// Lamps.
    pub lamp: Vec<LampSpec>,
}

/// A Gaussian: γ/(σ·sqrt(2π))·exp(-d²/2σ²) at distance d from its center (eq. 19 and 20).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GaussianSpec {
    /// Center μ, [x, y] in meters.
    pub center_m: Xy<Finite>,
    /// Width σ in meters.
    pub sigma_m: Positive,
    /// Strength γ.
    #[serde(default = "unit_strength")]
    pub gamma: Finite,
}

/// A lamp: peak/(1 + d²/half_distance²) at distance d.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LampSpec {
    /// Where the lamp is, [x, y] in meters.
    pub position_m: Xy<Finite>,
    /// Sensor counts at the lamp.
    pub peak: Finite,
    /// Distance in meters at which half of the peak is left.
    pub half_distance_m: Positive,
}

impl FieldSpec {
    /// Largest reading of a light sensor, about.
    pub(crate) fn counts_max(&self) -> f64 {
        let peaks = self.lamp.iter().map(|lamp| lamp.peak.get().abs());
        let gaussians = self.gaussian.iter().map(|peak| (peak.gamma.get() / peak.sigma_m.get()).abs());
        let sum = self.offset.get().abs() + peaks.chain(gaussians).sum::<f64>();
        if sum > 0.0 { sum } else { 1.0 }
    }
}

impl Default for FieldSpec {
    fn default() -> Self {
        Self { offset: constant!(Finite, 0.0), gaussian: Vec::new(), lamp: Vec::new() }
    }
}

fn unit_strength() -> Finite {
    constant!(Finite, 1.0)
}

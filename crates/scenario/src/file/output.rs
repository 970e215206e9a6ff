//! `[output]`: what is recorded.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::number::Positive;

/// Recorded outputs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct OutputSpec {
    /// Seconds of virtual time between two rows of `metrics.csv`: a whole number of steps, or rounded to one.
    pub metrics_every_s: Positive,
    /// Seconds of virtual time between two times at which `poses.csv` holds every robot's pose: a whole number of
    /// steps, or rounded to one; without it there is no `poses.csv`.
    pub poses_every_s: Option<Positive>,
    /// Seconds of virtual time between two times at which a recording (`--record`) holds bodies and cells as shapes: a whole
    /// number of steps, or rounded to one.
    pub scene_every_s: Positive,
    /// Whether the run shows how packets fared by the number of robots that could disturb them, beside the
    /// closed form where one is known.
    pub crowding: bool,
}

impl Default for OutputSpec {
    fn default() -> Self {
        Self {
            metrics_every_s: constant!(Positive, 1.0),
            poses_every_s: None,
            scene_every_s: constant!(Positive, 0.5),
            crowding: false,
        }
    }
}

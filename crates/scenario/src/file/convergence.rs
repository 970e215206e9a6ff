//! `[convergence]`: when the swarm has converged.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::number::Positive;

/// When the swarm counts as converged.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ConvergenceSpec {
    /// The swarm has converged when the mean estimated error, in meters, falls below this.
    pub tolerance_m: Positive,
    /// Whether the run ends there.
    pub stop: bool,
}

impl Default for ConvergenceSpec {
    fn default() -> Self {
        Self { tolerance_m: constant!(Positive, 1e-7), stop: false }
    }
}

//! `[fuzz]`: bounds of random fault plans.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::fault::kind::FaultKind;
use crate::number::{FaultCount, Positive, Probability, Share};

/// Bounds of the random fault plans of `lamplight fuzz`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct FuzzSpec {
    /// Most faults in one plan.
    pub faults_max: FaultCount,
    /// Kinds to draw from; default all but "field", so that seeds keep the plans that they had before there was this kind.
    pub kinds: Vec<FaultKind>,
    /// Length of each run in seconds of virtual time; default `duration_s`, at most 20.
    pub duration_s: Option<Positive>,
    /// Highest chance of any kind.
    pub probability_max: Probability,
    /// Largest share of the robots that one fault strikes.
    pub share_max: Share,
    /// Longest delay of a packet or an answer, seconds.
    pub delay_max_s: Positive,
}

/// Longest run, in seconds of virtual time, that nobody asked for.
const LONGEST_S: Positive = constant!(Positive, 20.0);

impl FuzzSpec {
    /// Length of each run of a scenario that is itself so long, in seconds of virtual time.
    pub fn run_s(&self, duration_s: Positive) -> Positive {
        self.duration_s.unwrap_or(if duration_s < LONGEST_S { duration_s } else { LONGEST_S })
    }
}

impl Default for FuzzSpec {
    fn default() -> Self {
        Self {
            faults_max: constant!(FaultCount, 6),
            kinds: FaultKind::ALL.iter().copied().filter(|kind| *kind != FaultKind::Field).collect(),
            duration_s: None,
            probability_max: constant!(Probability, 0.9),
            share_max: constant!(Share, 0.5),
            delay_max_s: constant!(Positive, 2.0),
        }
    }
}

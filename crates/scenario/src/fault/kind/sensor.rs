//! `sensor`: light sensors read too much, noise, or always the same.

use std::ops::Not;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::fault::drawer::{Drawer, short};
use crate::fault::entry::Entry;
use crate::fault::nature::{Nature, Strikes, Window};
use crate::fault::parameters::Parameters;
use crate::number::{Finite, Positive};
use crate::problem::Problem;

/// Light sensors read false values.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Sensor {
    /// Added to each light reading, counts.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bias_counts: Option<Finite>,
    /// Standard deviation of noise added to each light reading, counts.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise_counts: Option<Positive>,
    /// Whether the reading is stuck where it was when the fault began.
    #[serde(default, skip_serializing_if = "Not::not")]
    pub stuck: bool,
}

impl Parameters for Sensor {
    const NATURE: Nature = Nature::of(Strikes::Robots);

    fn check(&self, entry: &Entry<'_>) -> Result<(), Problem> {
        let is_there = self.bias_counts.is_some() || self.noise_counts.is_some() || entry.gives("stuck");
        entry.one_of(&["bias_counts", "noise_counts", "stuck"], is_there || self.stuck)?;
        entry.counts("bias_counts", self.bias_counts.map(Finite::get))?;
        entry.counts("noise_counts", self.noise_counts.map(Positive::get))?;
        entry.flag("stuck", self.stuck)
    }

    fn drawn(draw: &mut Drawer<'_>, _: &Window) -> Self {
        let (given, counts) = (1 + draw.below(7), draw.counts_max());
        Self {
            bias_counts: (given & 1 > 0).then(|| draw.finite(counts)).flatten(),
            noise_counts: (given & 2 > 0)
                .then(|| Positive::new(short(draw.between(0.01, 1.0) * counts)))
                .flatten(),
            stuck: given & 4 > 0,
        }
    }
}

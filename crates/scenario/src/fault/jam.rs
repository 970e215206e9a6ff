//! `jam`: nobody inside a disc hears anything.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Disc, Drawer, Entry, Nature, Parameters, Strikes, Window};
use crate::problem::Problem;

/// Robots inside a disc hear nothing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Jam {
    /// The disc: a place, whoever is in it.
    pub region: Disc,
}

impl Parameters for Jam {
    const NATURE: Nature = Nature { silences: true, ..Nature::of(Strikes::ByItsKeys) };

    fn check(&self, entry: &Entry<'_>) -> Result<(), Problem> {
        entry.reaches(self.region)
    }

    fn drawn(draw: &mut Drawer<'_>, _: &Window) -> Self {
        Self { region: draw.disc() }
    }
}

//! `jam`: nobody inside a disc hears anything.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::fault::drawer::Drawer;
use crate::fault::entry::Entry;
use crate::fault::nature::{Nature, Strikes, Window};
use crate::fault::parameters::Parameters;
use crate::fault::target::Disc;
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

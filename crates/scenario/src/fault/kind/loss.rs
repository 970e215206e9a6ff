//! `loss`: each packet is lost by its own chance.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::fault::drawer::Drawer;
use crate::fault::nature::{Nature, Strikes, Window};
use crate::fault::parameters::Parameters;
use crate::number::Probability;

/// Packets are lost, each by its own chance.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Loss {
    /// Chance that a packet is struck.
    pub probability: Probability,
}

impl Parameters for Loss {
    const NATURE: Nature = Nature { silences: true, ..Nature::of(Strikes::Packets) };

    fn drawn(draw: &mut Drawer<'_>, _: &Window) -> Self {
        Self { probability: draw.probability() }
    }
}

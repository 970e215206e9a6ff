//! `duplicate`: packets come twice, the second time perhaps later.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::fault::drawer::Drawer;
use crate::fault::entry::Entry;
use crate::fault::nature::{Nature, Strikes, Window};
use crate::fault::parameters::Parameters;
use crate::number::{NonNegative, Probability};
use crate::problem::Problem;
use crate::steps::Settling;

/// Packets come twice.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Duplicate {
    /// Chance that a packet is struck.
    pub probability: Probability,
    /// How late second copies come, seconds; default 0.
    #[serde(default = "none")]
    pub delay_s: NonNegative,
}

fn none() -> NonNegative {
    constant!(NonNegative, 0.0)
}

impl Parameters for Duplicate {
    // The packet itself comes in time, whatever its copies do.
    const NATURE: Nature = Nature::of(Strikes::Packets);

    fn check(&self, entry: &Entry<'_>) -> Result<(), Problem> {
        if self.delay_s == none() { Ok(()) } else { entry.delays(self.delay_s.get()) }
    }

    fn settle(&mut self, path: &dyn Fn(&str) -> String, settling: &mut Settling<'_>) -> Result<(), Problem> {
        settling.settle(&path("delay_s"), 0, Some(&mut self.delay_s))
    }

    fn drawn(draw: &mut Drawer<'_>, _: &Window) -> Self {
        let probability = draw.probability();
        let delay_s = if draw.chance(0.5) { draw.delay().get() } else { 0.0 };
        Self { probability, delay_s: NonNegative::new(delay_s).expect("it is no less than 0") }
    }
}

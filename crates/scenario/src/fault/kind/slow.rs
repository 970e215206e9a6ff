//! `slow`: agents answer late; until then their last command stands.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::fault::drawer::Drawer;
use crate::fault::entry::Entry;
use crate::fault::nature::{Nature, Strikes, Window};
use crate::fault::parameters::Parameters;
use crate::number::Positive;
use crate::problem::Problem;
use crate::steps::Settling;

/// Answers of agents come late.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Slow {
    /// How late answers come, seconds.
    pub delay_s: Positive,
}

impl Parameters for Slow {
    // Until a new answer comes, the last packet is sent again.
    const NATURE: Nature = Nature { exclusive: true, ..Nature::of(Strikes::Robots) };

    fn check(&self, entry: &Entry<'_>) -> Result<(), Problem> {
        entry.delays(self.delay_s.get())
    }

    fn settle(&mut self, path: &dyn Fn(&str) -> String, settling: &mut Settling<'_>) -> Result<(), Problem> {
        settling.settle(&path("delay_s"), 1, Some(&mut self.delay_s))
    }

    fn lateness(&self) -> Option<(&'static str, f64)> {
        Some(("answers come", self.delay_s.get()))
    }

    fn drawn(draw: &mut Drawer<'_>, _: &Window) -> Self {
        Self { delay_s: draw.delay() }
    }
}

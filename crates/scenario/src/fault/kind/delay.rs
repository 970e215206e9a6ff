//! `delay`: packets come late; with jitter they may overtake each other.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::fault::drawer::{Drawer, short};
use crate::fault::entry::Entry;
use crate::fault::nature::{Nature, Strikes, Window};
use crate::fault::parameters::Parameters;
use crate::number::{NonNegative, Positive};
use crate::problem::Problem;
use crate::steps::Settling;

/// Packets come late, and perhaps overtake each other.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Delay {
    /// How late packets come, seconds.
    pub delay_s: Positive,
    /// Up to how much later still, uniformly at random, seconds; default 0.
    #[serde(default = "none")]
    pub jitter_s: NonNegative,
}

fn none() -> NonNegative {
    constant!(NonNegative, 0.0)
}

impl Parameters for Delay {
    const NATURE: Nature = Nature { silences: true, ..Nature::of(Strikes::Packets) };

    fn check(&self, entry: &Entry<'_>) -> Result<(), Problem> {
        entry.delays(self.delay_s.get())
    }

    /// The sum with jitter is rounded, packet by packet.
    fn settle(&mut self, path: &dyn Fn(&str) -> String, settling: &mut Settling<'_>) -> Result<(), Problem> {
        if self.jitter_s == none() {
            return settling.settle(&path("delay_s"), 1, Some(&mut self.delay_s));
        }
        settling.bound(&path("jitter_s"), self.jitter_s.get())?;
        settling.bound(&path("delay_s"), self.delay_s.get())
    }

    fn lateness(&self) -> Option<(&'static str, f64)> {
        Some(("packets come up to", self.delay_s.get() + self.jitter_s.get()))
    }

    fn drawn(draw: &mut Drawer<'_>, _: &Window) -> Self {
        let (delay_s, most) = (draw.delay(), draw.delay_max_s());
        let jitter_s = if draw.chance(0.6) { draw.between(0.0, most) } else { 0.0 };
        Self { delay_s, jitter_s: NonNegative::new(short(jitter_s).min(most)).expect("it is no less than 0") }
    }
}

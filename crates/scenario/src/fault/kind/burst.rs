//! `burst`: each link is good or bad, and stays so for a while (Gilbert 1960, Elliott 1963).

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::fault::drawer::{Drawer, short};
use crate::fault::entry::Entry;
use crate::fault::nature::{Nature, Strikes, Window};
use crate::fault::parameters::Parameters;
use crate::number::Probability;
use crate::problem::{Problem, ensure};

/// Packets are lost in bursts, link by link (Gilbert-Elliott).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Burst {
    /// Chance per neighbor cycle that a good link turns bad.
    pub p: Probability,
    /// Chance per neighbor cycle that a bad link turns good.
    pub r: Probability,
    /// Chance that a packet is lost on a bad link (Gilbert-Elliott 1 − h); default 1.
    #[serde(default = "always")]
    pub loss_bad: Probability,
    /// Chance that a packet is lost on a good link (Gilbert-Elliott 1 − k); default 0.
    #[serde(default = "never")]
    pub loss_good: Probability,
}

fn always() -> Probability {
    constant!(Probability, 1.0)
}

fn never() -> Probability {
    constant!(Probability, 0.0)
}

impl Parameters for Burst {
    const NATURE: Nature = Nature { silences: true, ..Nature::of(Strikes::Packets) };

    fn check(&self, entry: &Entry<'_>) -> Result<(), Problem> {
        ensure(self.p.get() + self.r.get() > 0.0, || {
            entry.problem(&["p", "r"], "p and r are both 0: links would never change")
        })
    }

    fn drawn(draw: &mut Drawer<'_>, _: &Window) -> Self {
        Self {
            p: draw.probability(),
            r: Probability::new(short(draw.between(0.05, 1.0)).min(1.0)).expect("it is from 0 to 1"),
            loss_bad: if draw.chance(0.5) { draw.probability() } else { always() },
            loss_good: if draw.chance(0.5) { draw.probability() } else { never() },
        }
    }
}

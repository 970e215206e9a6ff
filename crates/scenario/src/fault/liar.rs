//! `liar`: packets carry a false reading, or another robot's name.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Drawer, Entry, Nature, Parameters, Strikes, Window};
use crate::number::Finite;
use crate::problem::Problem;

/// Packets carry a false reading or a false name.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Liar {
    /// The light reading that packets falsely carry, counts.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub light_counts: Option<Finite>,
    /// The robot that packets falsely claim to come from.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub identity: Option<u32>,
}

impl Parameters for Liar {
    // They speak as always, if falsely.
    const NATURE: Nature = Nature::of(Strikes::Robots);

    fn check(&self, entry: &Entry<'_>) -> Result<(), Problem> {
        let is_there = self.light_counts.is_some() || self.identity.is_some();
        entry.one_of(&["light_counts", "identity"], is_there)?;
        entry.counts("light_counts", self.light_counts.map(Finite::get))?;
        self.identity.map_or(Ok(()), |robot| entry.knows("identity", robot))
    }

    fn cut(&mut self, count: u32) -> bool {
        self.identity.is_none_or(|robot| robot < count)
    }

    fn drawn(draw: &mut Drawer<'_>, _: &Window) -> Self {
        let (given, counts) = (1 + draw.below(3), draw.counts_max());
        Self {
            light_counts: (given & 1 > 0).then(|| draw.finite(counts)).flatten(),
            identity: (given & 2 > 0).then(|| draw.robot()),
        }
    }
}

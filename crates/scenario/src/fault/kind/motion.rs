//! `motion`: bodies are stuck, or drift off their course.

use std::ops::Not;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::fault::drawer::Drawer;
use crate::fault::entry::Entry;
use crate::fault::nature::{Nature, Strikes, Window};
use crate::fault::parameters::Parameters;
use crate::number::{Finite, Xy};
use crate::problem::Problem;

/// Fastest drift, meters per second along each axis: poses stay finite.
const DRIFT_MAX_M_PER_S: f64 = 1e6;

/// Bodies do not move as commanded.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Motion {
    /// Whether the body is stuck where it was when the fault began.
    #[serde(default, skip_serializing_if = "Not::not")]
    pub stuck: bool,
    /// Velocity added to the commanded one, [ahead, left] in meters per second.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub drift_m_per_s: Option<Xy<Finite>>,
}

impl Parameters for Motion {
    const NATURE: Nature = Nature::of(Strikes::Robots);

    fn check(&self, entry: &Entry<'_>) -> Result<(), Problem> {
        let is_there = self.stuck || self.drift_m_per_s.is_some() || entry.gives("stuck");
        entry.one_of(&["stuck", "drift_m_per_s"], is_there)?;
        for axis in self.drift_m_per_s.into_iter().flat_map(Xy::get) {
            entry.within("drift_m_per_s", Some(axis), DRIFT_MAX_M_PER_S)?;
        }
        entry.flag("stuck", self.stuck)
    }

    fn drawn(draw: &mut Drawer<'_>, _: &Window) -> Self {
        let given = 1 + draw.below(3);
        Self { stuck: given & 1 > 0, drift_m_per_s: (given & 2 > 0).then(|| draw.velocity()).flatten() }
    }
}

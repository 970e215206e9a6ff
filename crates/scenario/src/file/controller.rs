//! `[controller]`: the control law.

use std::num::NonZeroU32;

use protocol::setup::Law;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::controller::{ControllerSpec, Gradient};
use crate::file::without_meaning;
use crate::number::Positive;
use crate::problem::{Problem, problem};
use crate::schema::LawName;

/// The controller every robot runs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct ControllerKeys {
    /// Control law.
    #[serde(default = "linear")]
    #[schemars(with = "LawName")]
    pub(crate) law: Law,
    /// Gain k of eq. 8, per second; k times a neighbor cycle is at most 1.5.
    pub(crate) gain_per_s: Positive,
    /// Where the gradient of φ comes from.
    #[serde(default)]
    pub(crate) gradient: GradientSource,
    /// Magnitude of the gradient, sensor counts per meter; with `gradient = "fixed"` and only there.
    pub(crate) gradient_magnitude_per_m: Option<Positive>,
    /// A neighbor not heard for this many neighbor cycles is forgotten; default 4 wherever packets can be lost or
    /// late: with `channel.loss`, `channel.soft_edge_m`, `channel.occlusion`, any `channel.access` but `"instant"`, or
    /// a fault of kind `loss`, `burst`, `delay`, `corrupt`, `partition` or `jam`. Elsewhere 1, as silence means gone.
    pub(crate) neighbor_timeout_cycles: Option<NonZeroU32>,
    /// Base in meters of the triangle that closes the cell of a robot with all neighbors on one bearing.
    #[serde(default = "triangle_side")]
    pub(crate) triangle_base_m: Positive,
    /// Height of that triangle in meters.
    #[serde(default = "triangle_side")]
    pub(crate) triangle_height_m: Positive,
    /// Distance in meters of the line that closes a bearing gap of π or more.
    #[serde(default = "close_distance")]
    pub(crate) close_distance_m: Positive,
    /// Distance in meters at which every cell is cut off; without it cells are not capped.
    pub(crate) cell_cap_m: Option<Positive>,
}

/// Where a robot's gradient of φ comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum GradientSource {
    /// The sensor measures it (Section IV).
    #[default]
    Measured,
    /// Its magnitude is fixed, its direction is towards the stimulus (Section V).
    Fixed,
}

impl ControllerKeys {
    /// The law with its parameters, where neighbors are remembered for `timeout_cycles` unless it is given.
    pub(crate) fn resolve(self, timeout_cycles: NonZeroU32) -> Result<ControllerSpec, Problem> {
        let gradient = match (self.gradient, self.gradient_magnitude_per_m) {
            (GradientSource::Measured, None) => Gradient::Measured,
            (GradientSource::Fixed, Some(magnitude_per_m)) => Gradient::Fixed { magnitude_per_m },
            (GradientSource::Fixed, None) => {
                return Err(problem(
                    &["controller.gradient"],
                    "controller.gradient = \"fixed\" needs `gradient_magnitude_per_m` in [controller]",
                ));
            }
            (GradientSource::Measured, Some(_)) => {
                let path = "controller.gradient_magnitude_per_m";
                return Err(without_meaning(path, "controller.gradient", "measured"));
            }
        };
        Ok(ControllerSpec {
            law: self.law,
            gain_per_s: self.gain_per_s,
            gradient,
            neighbor_timeout_cycles: self.neighbor_timeout_cycles.unwrap_or(timeout_cycles),
            triangle_base_m: self.triangle_base_m,
            triangle_height_m: self.triangle_height_m,
            close_distance_m: self.close_distance_m,
            cell_cap_m: self.cell_cap_m,
        })
    }
}

impl From<ControllerSpec> for ControllerKeys {
    fn from(controller: ControllerSpec) -> Self {
        let (gradient, gradient_magnitude_per_m) = match controller.gradient {
            Gradient::Measured => (GradientSource::Measured, None),
            Gradient::Fixed { magnitude_per_m } => (GradientSource::Fixed, Some(magnitude_per_m)),
        };
        Self {
            law: controller.law,
            gain_per_s: controller.gain_per_s,
            gradient,
            gradient_magnitude_per_m,
            neighbor_timeout_cycles: Some(controller.neighbor_timeout_cycles),
            triangle_base_m: controller.triangle_base_m,
            triangle_height_m: controller.triangle_height_m,
            close_distance_m: controller.close_distance_m,
            cell_cap_m: controller.cell_cap_m,
        }
    }
}

fn linear() -> Law {
    Law::Linear
}

fn triangle_side() -> Positive {
    constant!(Positive, 0.6)
}

fn close_distance() -> Positive {
    constant!(Positive, 0.25)
}

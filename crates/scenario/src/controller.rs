//! The controller, resolved.

use std::num::NonZeroU32;

use protocol::setup::{GradientMode, Law};

use super::number::Positive;

/// The control law that every robot runs, with its parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct ControllerSpec {
    /// Control law.
    pub law: Law,
    /// Gain k of eq. 8, per second.
    pub gain_per_s: Positive,
    /// Where the gradient of φ comes from.
    pub gradient: Gradient,
    /// A neighbor not heard for this many neighbor cycles is forgotten.
    pub neighbor_timeout_cycles: NonZeroU32,
    /// Base in meters of the triangle that closes the cell of a robot with all neighbors on one bearing.
    pub triangle_base_m: Positive,
    /// Height of that triangle in meters.
    pub triangle_height_m: Positive,
    /// Distance in meters of the line that closes a bearing gap of π or more.
    pub close_distance_m: Positive,
    /// Distance in meters at which every cell is cut off, if it is.
    pub cell_cap_m: Option<Positive>,
}

/// Where a robot's gradient of φ comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Gradient {
    /// The sensor measures it (Section IV).
    Measured,
    /// Its direction is towards the stimulus, its magnitude is fixed (Section V).
    Fixed {
        /// Sensor counts per meter.
        magnitude_per_m: Positive,
    },
}

impl From<Gradient> for GradientMode {
    fn from(gradient: Gradient) -> Self {
        match gradient {
            Gradient::Measured => Self::Measured,
            Gradient::Fixed { magnitude_per_m } => Self::Fixed(magnitude_per_m.get()),
        }
    }
}

//! The robots' bodies and where they start, resolved.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::number::{Finite, NonNegative, Positive, Xy};

/// The robots' bodies and where they start.
#[derive(Clone, Debug, PartialEq)]
pub struct RobotsSpec {
    /// How many there are.
    pub count: u32,
    /// Radius of a body in meters; 0 for points.
    pub radius_m: NonNegative,
    /// Highest speed in meters per second, if there is one.
    pub speed_limit_m_per_s: Option<Positive>,
    /// How a robot moves.
    pub drive: Drive,
    /// Highest turning speed in radians per second, for a differential drive.
    pub turn_limit_rad_per_s: Positive,
    /// Start of each robot, [x, y] in meters; without it they are placed uniformly at random.
    pub positions_m: Option<Vec<Xy<Finite>>>,
    /// Heading of each robot at the start in radians, counter-clockwise from the x axis; without it random.
    pub headings_rad: Option<Vec<Finite>>,
}

/// How a robot moves.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Drive {
    /// In any direction at once.
    #[default]
    Holonomic,
    /// Forward while turning, as on two wheels.
    Differential,
}

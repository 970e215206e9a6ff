//! Sensors beside those for light, walls and other robots, resolved.

use super::number::NonNegative;

/// Sensors that the scenario grants.
#[derive(Clone, Debug, PartialEq)]
pub struct SensorsSpec {
    /// Odometry, if robots have it: they turn and move what they have heard along with their bodies.
    pub odometry: Option<OdometrySpec>,
}

/// Odometry of every robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OdometrySpec {
    /// Standard deviation of each tick's displacement and, on its own, of its turn, as a share of it.
    pub error: NonNegative,
}

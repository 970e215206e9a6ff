//! Sensors beside those for light, walls and other robots, resolved.

use serde::{Deserialize, Serialize};

use super::number::NonNegative;

/// Sensors that the scenario grants.
#[derive(Clone, Debug, PartialEq)]
pub struct SensorsSpec {
    /// Odometry, if robots have it: they turn and move what they have heard along with their bodies.
    pub odometry: Option<OdometrySpec>,
    /// Whether robots know their heading in the arena.
    pub compass: bool,
    /// Whether robots know their position in the arena.
    pub position: bool,
}

/// A sensor that robots can be granted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Sensor {
    /// The light where they stand.
    Light,
    /// The bump skirt.
    Bump,
    /// Walls: `arena.boundary_sensing`.
    Walls,
    /// Their own motion: `sensors.odometry`.
    Odometry,
    /// Their heading in the arena: `sensors.compass`.
    Compass,
    /// Their position in the arena: `sensors.position`.
    Position,
    /// The true field: with the law `exact`.
    Field,
}

/// Odometry of every robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OdometrySpec {
    /// Standard deviation of each tick's displacement and, on its own, of its turn, as a share of it.
    pub error: NonNegative,
}

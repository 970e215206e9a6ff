//! Destinations of what is measured of the agents.

use profile::{ProfileSlot, WatchedCycles};
use scenario::RobotSet;

/// Destinations of what is measured of the agents.
#[derive(Clone, Debug, Default)]
pub struct Measure {
    /// The whole, at the end.
    pub profile: ProfileSlot,
    /// The last moments, while somebody watches.
    pub watched: WatchedCycles,
    /// Robots whose whole cycles are wanted one by one, as soon as they are known.
    pub cycles_of: Option<RobotSet>,
}

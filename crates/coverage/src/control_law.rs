//! The trait of control laws: a step from cell and percept to a goal.

use nalgebra::Vector2;
use protocol::{controller::StageObserver, frame::BodyVector, percept::Percept};

use crate::{estimate::GradientMode, neighbors::NeighborTable};

/// All that a law may go by: what a robot knows in one cycle.
pub struct Situation<'a> {
    /// The robot's cell.
    pub cell: &'a [Vector2<f64>],
    /// Its percept: packets heard, and readings.
    pub percept: &'a Percept,
    /// Neighbors that it knows of.
    pub neighbors: &'a NeighborTable,
    /// Source of the gradient.
    pub gradient: GradientMode,
}

/// A control law.
pub trait ControlLaw {
    /// Whether the robot must be shown the true field, which nobody senses.
    const NEEDS_FIELD: bool = false;
    /// Whether the law goes by the light, of which there must then be some.
    const GOES_BY_LIGHT: bool = true;
    /// Whether the law cuts the cell to V+, and tells `stages` of it.
    const TRUNCATES: bool = false;

    /// The estimated centroid Ĉ relative to the robot; `None` means stay. The cell is not empty.
    fn goal(situation: &Situation<'_>, stages: &mut dyn StageObserver) -> Option<BodyVector>;
}

//! Control laws: cell and percept -> goal.
//!
//! A law is one file here, one line in [`goal`] and its name in [`Law`].

mod exact;
mod linear;
mod quadratic;
mod uniform;

use nalgebra::Vector2;
use protocol::{
    controller::{Stage, StageObserver},
    frame::BodyVector,
    percept::Percept,
};

use crate::{
    neighbors::NeighborTable,
    setup::{CoverageSetup, Law},
};

/// The estimated centroid Ĉ of `cell` relative to the robot; `None` means stay. An empty cell has none.
///
/// Tells `stages` of [`Stage::Truncation`] once, at once where nothing is truncated; what comes after it is the
/// centroid's.
pub fn goal(
    cell: &[Vector2<f64>],
    percept: &Percept,
    neighbors: &NeighborTable,
    setup: &CoverageSetup,
    stages: &mut dyn StageObserver,
) -> Option<BodyVector> {
    let truncates = matches!(setup.law, Law::Linear | Law::Quadratic);
    if cell.is_empty() || !truncates {
        stages.passed(Stage::Truncation);
    }
    if cell.is_empty() {
        return None;
    }
    match setup.law {
        Law::Linear => linear::goal(cell, &percept.light, setup.gradient, stages),
        Law::Quadratic => quadratic::goal(cell, &percept.light, neighbors, setup.gradient, stages),
        Law::Uniform => uniform::goal(cell),
        Law::Exact => exact::goal(cell, &percept.field),
    }
}

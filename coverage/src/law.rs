//! Control laws: cell and percept -> goal.
//!
//! A law is one file here and one line in [`goal`].

mod exact;
mod linear;
mod quadratic;
mod uniform;

use nalgebra::Vector2;
use protocol::{
    frame::BodyVector,
    percept::Percept,
    setup::{ControllerSetup, Law},
};

use crate::neighbors::NeighborTable;

/// The estimated centroid Ĉ of `cell` relative to the robot; `None` means stay.
pub fn goal(
    cell: &[Vector2<f64>],
    percept: &Percept,
    neighbors: &NeighborTable,
    setup: &ControllerSetup,
) -> Option<BodyVector> {
    match setup.law {
        Law::Linear => linear::goal(cell, &percept.light, setup.gradient),
        Law::Quadratic => quadratic::goal(cell, &percept.light, neighbors, setup.gradient),
        Law::Uniform => uniform::goal(cell),
        Law::Exact => exact::goal(cell, &percept.field),
    }
}

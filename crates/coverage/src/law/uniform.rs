//! Lloyd's law: every place matters the same, the goal is the cell's geometric center.

use nalgebra::Vector2;
use protocol::frame::BodyVector;

use crate::{centroid, estimate::LinearField};

pub(super) fn goal(cell: &[Vector2<f64>]) -> Option<BodyVector> {
    centroid::mass(cell, &LinearField::UNIFORM).map(|mass| BodyVector(mass.centroid))
}

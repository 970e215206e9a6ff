//! The paper's law: φ as its value and gradient at the robot foretell it (eq. 10 to 18).

use crate::setup::GradientMode;
use nalgebra::Vector2;
use protocol::{
    controller::{Stage, StageObserver},
    frame::BodyVector,
    percept::Light,
};

use crate::{centroid, estimate::LinearField, polygon::Polygon};

pub(super) fn goal(
    cell: &[Vector2<f64>],
    light: &Light,
    gradient: GradientMode,
    stages: &mut dyn StageObserver,
) -> Option<BodyVector> {
    let estimate = LinearField::sensed(light, gradient);
    let mut part = Polygon::new();
    let positive = estimate.positive_part(cell, &mut part);
    stages.passed(Stage::Truncation);
    centroid::mass(positive, &estimate).map(|mass| BodyVector(mass.centroid))
}

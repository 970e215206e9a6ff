//! The paper's law: φ as its value and gradient at the robot foretell it (eq. 10 to 18).

use protocol::{
    controller::{Stage, StageObserver},
    frame::BodyVector,
};

use super::{ControlLaw, Situation};
use crate::{centroid, estimate::LinearField, polygon::Polygon};

pub(super) struct Linear;

impl ControlLaw for Linear {
    const TRUNCATES: bool = true;

    fn goal(situation: &Situation<'_>, stages: &mut dyn StageObserver) -> Option<BodyVector> {
        let Situation { cell, percept, setup, .. } = situation;
        let estimate = LinearField::sensed(&percept.light, setup.gradient);
        let mut part = Polygon::new();
        let positive = estimate.positive_part(cell, &mut part);
        stages.passed(Stage::Truncation);
        centroid::mass(positive, &estimate).map(|mass| BodyVector(mass.centroid))
    }
}

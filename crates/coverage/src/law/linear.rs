//! The paper's law: φ as its value and gradient at the robot foretell it (eq. 10 to 18).

use protocol::{
    controller::{Stage, StageObserver},
    frame::BodyVector,
};

use crate::{
    centroid,
    control_law::{ControlLaw, Situation},
    estimate::LinearField,
    polygon::Polygon,
};

pub(super) struct Linear;

impl ControlLaw for Linear {
    const TRUNCATES: bool = true;

    fn goal(situation: &Situation<'_>, stages: &mut dyn StageObserver) -> Option<BodyVector> {
        let Situation { cell, percept, gradient, .. } = *situation;
        let estimate = LinearField::sensed(&percept.light, gradient);
        let mut part = Polygon::new();
        let positive = estimate.positive_part(cell, &mut part);
        stages.passed(Stage::Truncation);
        centroid::mass(positive, &estimate).map(|mass| BodyVector(mass.centroid))
    }
}

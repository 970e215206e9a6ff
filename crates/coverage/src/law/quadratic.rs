//! The paper's outlook: φ as the robot and its neighbors together foretell it, by a quadratic.
//!
//! Nobody foretells far: the robot answers for V+ of its affine estimate, as under the `linear` law,
//! which also cuts away where the quadratic would rise again behind its back. Where the quadratic is
//! negative in there, it is raised until it touches zero: continuous in all that was heard, and the
//! goal stays in the cell. Readings beyond reason leave the `linear` goal. A neighbor remembered over
//! silent cycles counts as when it was heard, one that shares no reading not at all.

use protocol::{
    controller::{Stage, StageObserver},
    frame::BodyVector,
};

use super::linear::Linear;
use crate::{
    cell::COINCIDENT_M,
    control_law::{ControlLaw, Situation},
    estimate::{GradientMode, LinearField},
    fit::{self, Slope},
    polygon::Polygon,
    reading,
};

pub(super) struct Quadratic;

impl ControlLaw for Quadratic {
    const TRUNCATES: bool = true;

    fn goal(situation: &Situation<'_>, stages: &mut dyn StageObserver) -> Option<BodyVector> {
        let Situation { cell, percept, neighbors, gradient } = *situation;
        let readings = neighbors
            .iter()
            .map(|neighbor| &neighbor.delivery)
            .filter(|heard| heard.range.get() > COINCIDENT_M)
            .filter_map(|heard| {
                Some((BodyVector::polar(heard.range, heard.bearing).0, reading::shared_in(&heard.packet)?))
            });
        let slope = match gradient {
            GradientMode::Measured => Slope::Known,
            GradientMode::Fixed(_) => Slope::Assumed,
        };
        let estimate = fit::quadratic(&LinearField::sensed(&percept.light, gradient), slope, readings);
        let mut part = Polygon::new();
        let positive = estimate.linear.positive_part(cell, &mut part);
        stages.passed(Stage::Truncation);
        let raised = estimate.raised_on(positive);
        raised
            .mass(positive)
            .map(|mass| BodyVector(mass.centroid))
            .or_else(|| Linear::goal(situation, &mut ()))
    }
}

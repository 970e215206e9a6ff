//! Lloyd's law: every place matters the same, the goal is the cell's geometric center.

use protocol::{controller::StageObserver, frame::BodyVector};

use crate::{
    centroid,
    control_law::{ControlLaw, Situation},
    estimate::LinearField,
};

pub(super) struct Uniform;

impl ControlLaw for Uniform {
    const GOES_BY_LIGHT: bool = false;

    fn goal(situation: &Situation<'_>, _: &mut dyn StageObserver) -> Option<BodyVector> {
        centroid::mass(situation.cell, &LinearField::UNIFORM).map(|mass| BodyVector(mass.centroid))
    }
}

//! The optimal baseline of Cortés et al.: the true centroid under the true φ, by quadrature.
//!
//! For comparison only. The scenario must bound the cells (boundary sensing or a cap): peaks much narrower than a cell
//! are integrated as well as any ([`crate::quadrature`]), but a cell hundreds of meters long has no useful centroid.

use nalgebra::Vector2;
use protocol::{controller::StageObserver, frame::BodyVector, percept::FieldComponent};

use crate::{
    control_law::{ControlLaw, Situation},
    quadrature::moments,
    refinement::FINE,
};

pub(super) struct Exact;

impl ControlLaw for Exact {
    const NEEDS_FIELD: bool = true;

    fn goal(situation: &Situation<'_>, _: &mut dyn StageObserver) -> Option<BodyVector> {
        centroid(situation.cell, &situation.percept.field)
    }
}

fn centroid(cell: &[Vector2<f64>], field: &[FieldComponent]) -> Option<BodyVector> {
    let [mass, x, y, _] = moments(field, cell, FINE);
    let centroid = BodyVector::new(x / mass, y / mass);
    (mass > 0.0 && centroid.is_finite()).then_some(centroid)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_goal_is_a_peak_a_hundred_thousandth_of_the_cell_wide() {
        let cell = [(-1.0, -2.0), (3.0, -2.0), (3.0, 2.0), (-1.0, 2.0)].map(|(x, y)| Vector2::new(x, y));
        let center = BodyVector::new(2.31, -0.77);
        let field = [FieldComponent::Gaussian { center, amplitude: 300.0, sigma_m: 4e-5 }];
        let goal = centroid(&cell, &field).unwrap();
        assert!((goal.0 - center.0).norm() < 1e-8, "{goal:?}");
    }
}

//! The optimal baseline of Cortés et al.: the true centroid under the true φ, by quadrature.
//!
//! For comparison only. The scenario must bound the cells (boundary sensing or a cap), or the
//! quadrature's accuracy is not kept.

use nalgebra::Vector2;
use protocol::{frame::BodyVector, percept::FieldComponent};

use crate::{
    quadrature::integrate,
    sensory_field::{length_scale, value},
};

pub(super) fn goal(cell: &[Vector2<f64>], field: &[FieldComponent]) -> Option<BodyVector> {
    let [mass, x, y] = integrate(cell, length_scale(field) / 2.0, |q| {
        let phi = value(field, q);
        [phi, phi * q.x, phi * q.y]
    });
    let centroid = BodyVector::new(x / mass, y / mass);
    (mass > 0.0 && centroid.is_finite()).then_some(centroid)
}

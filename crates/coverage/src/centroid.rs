//! V+ -> goal: the estimated mass and centroid of what this robot answers for.
//!
//! In:  V+, convex, counter-clockwise, meters, body frame; the affine estimate φ̂.
//! Out: M̂ (eq. 16) and Ĉ (eq. 18), same frame; `None` if V+ is empty or holds no mass, and then
//! the robot stays.

use nalgebra::Vector2;

use crate::{estimate::LinearField, moments::Moments};

/// Mass and centroid of a region under an estimate of φ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mass {
    /// M̂, in units of φ times m².
    pub mass: f64,
    /// Ĉ relative to the robot, meters.
    pub centroid: Vector2<f64>,
}

/// M̂ and Ĉ of `region` under `field`.
///
/// The moments are taken about a vertex of the region, where the estimate is `field.at(vertex)`:
/// a small V+ far from the robot then loses nothing either.
pub fn mass(region: &[Vector2<f64>], field: &LinearField) -> Option<Mass> {
    let about = *region.first()?;
    let moments = Moments::of(region, about);
    let value = field.at(&about);
    let mass = value * moments.area + field.gradient.dot(&moments.first);
    let first = moments.first * value + moments.second * field.gradient;
    let centroid = about + first / mass;
    (mass > 0.0 && centroid.x.is_finite() && centroid.y.is_finite()).then_some(Mass { mass, centroid })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square() -> [Vector2<f64>; 4] {
        [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| Vector2::new(x, y))
    }

    #[test]
    fn a_flat_field_pulls_to_the_middle() {
        let mass = mass(&square(), &LinearField::UNIFORM).unwrap();
        assert!((mass.mass - 4.0).abs() < 1e-15 && mass.centroid.norm() < 1e-15);
    }

    #[test]
    fn a_slope_pulls_uphill() {
        let field = LinearField { value: 3.0, gradient: Vector2::new(1.5, 0.0) };
        let mass = mass(&square(), &field).unwrap();
        // ∫ x(3 + 1.5x) over the square = 2 · 1.5 · 2/3 = 2, mass 12.
        assert!((mass.centroid - Vector2::new(1.0 / 6.0, 0.0)).norm() < 1e-15);
    }

    #[test]
    fn no_mass_means_no_goal() {
        let dark = LinearField { value: 0.0, gradient: Vector2::zeros() };
        assert_eq!(mass(&square(), &dark), None);
        assert_eq!(mass(&[], &LinearField::UNIFORM), None);
    }
}

//! Readings around the robot -> a quadratic estimate of φ, by ridge least squares.
//!
//! In:  the affine estimate at the robot; each neighbor's place (body frame) and reading.
//! Out: φ̂(q) = c + gᵀq + qᵀAq / 2. The value c is the robot's own reading and stays. A measured
//! gradient g stays too and the neighbors tell A alone; one of assumed magnitude is fitted with A.
//!
//! Each neighbor tells the curvature in its own direction, eᵀAe, as what its reading exceeds the
//! affine estimate by, over half its squared distance. These count alike, which weighs readings by
//! 1/d⁴ and so trusts the near ones. The ridge pulls towards the affine estimate: where neighbors
//! are too few it picks the least A that explains them, and without neighbors A is zero.

use core::f64::consts::SQRT_2;

use nalgebra::{Matrix2, SMatrix, SVector, Vector2};

use crate::{estimate::LinearField, quadratic_field::QuadraticField};

/// Weight of the ridge beside one neighbor's curvature: far below the error of the quadratic itself,
/// far above that of f64, so that it shows only where the readings do not decide.
const RIDGE: f64 = 1e-6;

/// Two of the slope and three of the curvature.
const UNKNOWNS: usize = 5;

/// Whether the robot's own gradient is measured or assumed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Slope {
    /// Measured: it stays.
    Known,
    /// Assumed: the readings may change it.
    Assumed,
}

/// The quadratic through `linear` at the robot that agrees best with the `readings`, each the place
/// (not the robot's own) and the φ there. Not finite if the readings are beyond reason.
pub fn quadratic(
    linear: &LinearField,
    slope: Slope,
    readings: impl Iterator<Item = (Vector2<f64>, f64)> + Clone,
) -> QuadraticField {
    // In units of the farthest neighbor's distance, so that the ridge does not depend on the scale.
    let scale = readings.clone().map(|(place, _)| place.norm()).fold(0.0, f64::max);
    let mut normal = SMatrix::<f64, UNKNOWNS, UNKNOWNS>::zeros();
    let mut right = SVector::<f64, UNKNOWNS>::zeros();
    for (place, reading) in readings {
        let distance = place.norm();
        let (e, d) = (place / distance, distance / scale);
        let per_slope = match slope {
            Slope::Known => 0.0,
            Slope::Assumed => 2.0 / d,
        };
        // The off-diagonal entry comes twice in A; as √2 A₁₂ it weighs so in the ridge as well, which
        // then is the same in every frame.
        let row = SVector::from([e.x * per_slope, e.y * per_slope, e.x * e.x, SQRT_2 * e.x * e.y, e.y * e.y]);
        let curvature = 2.0 * (reading - linear.at(&place)) / (d * d);
        normal += row * row.transpose();
        right += row * curvature;
    }
    normal += SMatrix::identity() * RIDGE;
    let unchanged = QuadraticField { linear: *linear, curvature: Matrix2::zeros() };
    let Some(solution) = normal.cholesky().map(|factor| factor.solve(&right)).filter(|_| scale > 0.0) else {
        return unchanged;
    };
    let [slope_x, slope_y, xx, xy, yy] = solution.into();
    let gradient = linear.gradient + Vector2::new(slope_x, slope_y) / scale;
    let curvature = Matrix2::new(xx, xy / SQRT_2, xy / SQRT_2, yy) / (scale * scale);
    QuadraticField { linear: LinearField { gradient, ..*linear }, curvature }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLACES: [(f64, f64); 6] =
        [(0.3, 0.1), (-0.1, 0.4), (-0.3, -0.2), (0.2, -0.3), (0.05, 0.5), (-0.4, 0.15)];

    fn truth() -> QuadraticField {
        QuadraticField {
            linear: LinearField { value: 2.0, gradient: Vector2::new(0.7, -0.4) },
            curvature: Matrix2::new(1.5, 0.6, 0.6, -0.8),
        }
    }

    fn readings(field: QuadraticField) -> impl Iterator<Item = (Vector2<f64>, f64)> + Clone {
        PLACES.iter().map(move |&(x, y)| (Vector2::new(x, y), field.at(&Vector2::new(x, y))))
    }

    #[test]
    fn a_quadratic_is_found_again() {
        let found = quadratic(&truth().linear, Slope::Known, readings(truth()));
        assert_eq!(found.linear, truth().linear, "what the robot measures stays");
        assert!((found.curvature - truth().curvature).norm() < 1e-5, "{}", found.curvature);
    }

    #[test]
    fn an_assumed_slope_is_corrected() {
        let assumed = LinearField { gradient: Vector2::new(3.0, 0.0), ..truth().linear };
        let found = quadratic(&assumed, Slope::Assumed, readings(truth()));
        assert!((found.linear.gradient - truth().linear.gradient).norm() < 1e-3, "{:?}", found.linear);
        assert!((found.curvature - truth().curvature).norm() < 1e-2, "{}", found.curvature);
    }

    #[test]
    fn one_neighbor_tells_the_curvature_in_its_direction_alone() {
        let field = QuadraticField { curvature: Matrix2::new(1.5, 0.0, 0.0, 9.0), ..truth() };
        let ahead = Vector2::new(0.3, 0.0);
        let found = quadratic(&field.linear, Slope::Known, core::iter::once((ahead, field.at(&ahead))));
        assert!((found.curvature - Matrix2::new(1.5, 0.0, 0.0, 0.0)).norm() < 1e-5, "{}", found.curvature);
    }

    #[test]
    fn nobody_leaves_the_estimate_as_it_is() {
        for slope in [Slope::Known, Slope::Assumed] {
            let found = quadratic(&truth().linear, slope, core::iter::empty());
            assert_eq!(found, QuadraticField { curvature: Matrix2::zeros(), ..truth() });
        }
    }
}

//! Integrals of a smooth function over a convex polygon.
//!
//! The polygon is fanned into triangles, these are split until no edge is longer than the given
//! resolution, and each piece gets a 6 × 6 Gauss-Legendre product rule under Duffy's map (exact
//! for polynomials up to degree 10). With a resolution of half the field's length scale the
//! relative error stays below 1e-10 for Gaussians and lamps; the tests measure it.

use nalgebra::Vector2;

/// Edges are split into at most this many parts, so a cell that reaches to the horizon costs
/// bounded time; beyond it the stated accuracy is not kept.
pub const SPLITS_MAX: usize = 64;

/// Nodes of the 6-point Gauss-Legendre rule on [0, 1].
const NODES: [f64; 6] = [
    0.033_765_242_898_423_99,
    0.169_395_306_766_867_74,
    0.380_690_406_958_401_55,
    0.619_309_593_041_598_5,
    0.830_604_693_233_132_3,
    0.966_234_757_101_576,
];
/// Weights of that rule.
const WEIGHTS: [f64; 6] = [
    0.085_662_246_189_585_17,
    0.180_380_786_524_069_3,
    0.233_956_967_286_345_52,
    0.233_956_967_286_345_52,
    0.180_380_786_524_069_3,
    0.085_662_246_189_585_17,
];

/// ∫ f over `polygon`, componentwise, with pieces no longer than `resolution_m`.
pub fn integrate<const K: usize>(
    polygon: &[Vector2<f64>],
    resolution_m: f64,
    f: impl Fn(Vector2<f64>) -> [f64; K],
) -> [f64; K] {
    let mut sum = [0.0; K];
    let Some((&apex, rest)) = polygon.split_first() else { return sum };
    for pair in rest.windows(2) {
        let (u, v) = (pair[0] - apex, pair[1] - apex);
        let longest = u.norm().max(v.norm()).max((v - u).norm());
        let splits = (libm::ceil(longest / resolution_m) as usize).clamp(1, SPLITS_MAX);
        let (u, v) = (u / splits as f64, v / splits as f64);
        for row in 0..splits {
            for column in 0..splits - row {
                let corner = apex + u * row as f64 + v * column as f64;
                add_triangle(&mut sum, corner, u, v, &f);
                if row + column + 1 < splits {
                    add_triangle(&mut sum, corner + u + v, -u, -v, &f);
                }
            }
        }
    }
    sum
}

/// Adds ∫ f over the triangle with `corner` and the edges `u`, `v` from it.
fn add_triangle<const K: usize>(
    sum: &mut [f64; K],
    corner: Vector2<f64>,
    u: Vector2<f64>,
    v: Vector2<f64>,
    f: &impl Fn(Vector2<f64>) -> [f64; K],
) {
    let doubled_area = u.perp(&v);
    for (s, weight_s) in NODES.iter().zip(WEIGHTS) {
        for (t, weight_t) in NODES.iter().zip(WEIGHTS) {
            // Duffy: the unit square folds onto the triangle with Jacobian s.
            let values = f(corner + (u * (1.0 - t) + v * *t) * *s);
            let weight = weight_s * weight_t * s * doubled_area;
            for (total, value) in sum.iter_mut().zip(values) {
                *total += weight * value;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use protocol::{frame::BodyVector, percept::FieldComponent};

    use super::*;
    use crate::sensory_field::{length_scale, value};

    fn square(side: f64) -> [Vector2<f64>; 4] {
        [(0.0, 0.0), (side, 0.0), (side, side), (0.0, side)].map(|(x, y)| Vector2::new(x, y))
    }

    #[test]
    fn polynomials_of_degree_ten_are_exact() {
        let [integral] = integrate(&square(1.0), 10.0, |q| [libm::pow(q.x, 6.0) * libm::pow(q.y, 4.0)]);
        assert!((integral - 1.0 / 35.0).abs() < 1e-16);
    }

    #[test]
    fn a_gaussian_matches_its_error_functions() {
        for sigma_m in [0.05, 0.2, 0.7] {
            let field =
                [FieldComponent::Gaussian { center: BodyVector::new(0.2, 0.2), amplitude: 1.0, sigma_m }];
            let [integral] = integrate(&square(1.0), length_scale(&field) / 2.0, |q| [value(&field, q)]);
            let root = core::f64::consts::SQRT_2 * sigma_m;
            let line = sigma_m
                * libm::sqrt(core::f64::consts::PI / 2.0)
                * (libm::erf(0.8 / root) + libm::erf(0.2 / root));
            assert!((integral / (line * line) - 1.0).abs() < 1e-10, "sigma {sigma_m}: {integral}");
        }
    }

    #[test]
    fn a_lamp_does_not_change_when_the_pieces_are_halved() {
        let field = [FieldComponent::Lamp { position: BodyVector::HERE, peak: 500.0, half_distance_m: 0.5 }];
        let at = |resolution| integrate(&square(2.4), resolution, |q| [value(&field, q)])[0];
        assert!((at(0.25) / at(0.125) - 1.0).abs() < 1e-10);
    }

    #[test]
    fn nothing_has_no_integral() {
        assert_eq!(integrate(&[], 1.0, |_| [1.0]), [0.0]);
    }
}

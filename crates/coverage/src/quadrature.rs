//! Integrals of a smooth function over a convex polygon.
//!
//! The polygon is fanned into triangles, these are halved at their longest edge until they are fine enough, and each
//! piece gets a 6 × 6 Gauss-Legendre product rule under Duffy's map (exact for polynomials up to degree 10). What is
//! fine enough for φ is said by [`Refinement`]; then mass, first and second moments hold 1e-8 relative to those of the
//! magnitudes of φ's terms, down to peaks of [`crate::refinement::WIDTH_SHARE_MIN`] of the polygon's size.
//! `tests/narrow_fields.rs` measures it.

use arrayvec::ArrayVec;
use nalgebra::Vector2;
use protocol::percept::FieldComponent;

use crate::{polygon::Triangle, refinement::Refinement, sensory_field::value};

/// How often a triangle is halved, one half after the other, before its pieces are taken as they are.
///
/// After n halvings no edge is longer than √3·2^(−n/2) of the first (M. Stynes, Math. Comp. 35, 1980), so this is
/// enough for pieces of 1e-19 of the polygon's size. No cell that a scenario may have needs so many (a test computes
/// it): arenas, caps of cells and widths of peaks are bounded when it is read.
pub const HALVINGS_MAX: usize = 128;

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

/// Mass, first moments and half the second moment (about the origin) of φ over `polygon`, in pieces `coarseness` times
/// as long as [`crate::refinement::FINE`].
pub fn moments(field: &[FieldComponent], polygon: &[Vector2<f64>], coarseness: f64) -> [f64; 4] {
    let refinement = Refinement::new(field, polygon, coarseness);
    integrate(
        polygon,
        |piece, longest_m| refinement.suffices(piece, longest_m),
        |q| {
            let phi = value(field, q);
            [phi, phi * q.x, phi * q.y, phi * q.norm_squared() / 2.0]
        },
    )
}

/// ∫ f over `polygon`, componentwise, in pieces of which `suffices` says, by the length of their longest edge, that
/// they are fine enough.
pub fn integrate<const K: usize>(
    polygon: &[Vector2<f64>],
    suffices: impl Fn(&Triangle, f64) -> bool,
    f: impl Fn(Vector2<f64>) -> [f64; K],
) -> [f64; K] {
    let mut sum = [0.0; K];
    let Some((&apex, rest)) = polygon.split_first() else { return sum };
    // Of each halving one half waits, while the other is worked on.
    let mut waiting = ArrayVec::<Triangle, HALVINGS_MAX>::new();
    for pair in rest.windows(2) {
        let mut next = Some([apex, pair[0], pair[1]]);
        while let Some(piece) = next {
            let (longest_m, halves) = halved(&piece);
            if waiting.is_full() || suffices(&piece, longest_m) {
                add_triangle(&mut sum, &piece, &f);
                next = waiting.pop();
            } else {
                waiting.push(halves[1]);
                next = Some(halves[0]);
            }
        }
    }
    sum
}

/// The length of a triangle's longest edge, and the halves that a line from its middle makes.
fn halved(&[a, b, c]: &Triangle) -> (f64, [Triangle; 2]) {
    let [ab, bc, ca] = [b - a, c - b, a - c].map(|edge| edge.norm());
    let (longest, [start, end, opposite]) = if ab >= bc && ab >= ca {
        (ab, [a, b, c])
    } else if bc >= ca {
        (bc, [b, c, a])
    } else {
        (ca, [c, a, b])
    };
    let middle = (start + end) / 2.0;
    (longest, [[start, middle, opposite], [middle, end, opposite]])
}

/// Adds ∫ f over a triangle.
fn add_triangle<const K: usize>(
    sum: &mut [f64; K],
    &[corner, second, third]: &Triangle,
    f: &impl Fn(Vector2<f64>) -> [f64; K],
) {
    let (u, v) = (second - corner, third - corner);
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
    use super::*;

    fn square(side: f64) -> [Vector2<f64>; 4] {
        [(0.0, 0.0), (side, 0.0), (side, side), (0.0, side)].map(|(x, y)| Vector2::new(x, y))
    }

    #[test]
    fn polynomials_of_degree_ten_are_exact() {
        for length_m in [10.0, 0.3] {
            let [integral] = integrate(
                &square(1.0),
                |_, longest_m| longest_m <= length_m,
                |q| [libm::pow(q.x, 6.0) * libm::pow(q.y, 4.0)],
            );
            assert!((integral - 1.0 / 35.0).abs() < 1e-16);
        }
    }

    #[test]
    fn halves_are_counter_clockwise_and_share_the_area() {
        let doubled = |[a, b, c]: Triangle| (b - a).perp(&(c - a));
        let whole = [(0.0, 0.0), (0.4, 0.1), (-0.3, 0.9)].map(|(x, y)| Vector2::new(x, y));
        let (longest_m, [first, second]) = halved(&whole);
        assert_eq!(longest_m, (whole[2] - whole[1]).norm());
        assert!((doubled(first) - doubled(whole) / 2.0).abs() < 1e-15);
        assert!((doubled(second) - doubled(whole) / 2.0).abs() < 1e-15);
    }

    #[test]
    fn nothing_has_no_integral() {
        assert_eq!(integrate(&[], |_, _| true, |_| [1.0]), [0.0]);
    }
}

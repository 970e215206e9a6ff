//! The four third moments of a polygon, in closed form, about a point of it like [`crate::moments`].
//!
//! Each edge and the point span a triangle; over it q is λa + μb, and ∫ λⁱμʲ is i! j! / (i + j + 2)!
//! of twice its area.

use nalgebra::{Matrix2, Vector2};

use crate::polygon::edges;

/// ∫ q ⊗ q ⊗ q dq, m⁵.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ThirdMoments {
    /// ∫ x³ dq.
    pub xxx: f64,
    /// ∫ x²y dq.
    pub xxy: f64,
    /// ∫ xy² dq.
    pub xyy: f64,
    /// ∫ y³ dq.
    pub yyy: f64,
}

impl ThirdMoments {
    /// Third moments of a counter-clockwise `polygon` about the point `about`.
    pub fn of(polygon: &[Vector2<f64>], about: Vector2<f64>) -> Self {
        let mut sum = Self::default();
        for (start, end) in edges(polygon) {
            let (a, b) = (start - about, end - about);
            let cross = a.perp(&b);
            sum.xxx += cross * 3.0 * (a.x + b.x) * (a.x * a.x + b.x * b.x);
            sum.xxy += cross * mixed(a.x, a.y, b.x, b.y);
            sum.xyy += cross * mixed(a.y, a.x, b.y, b.x);
            sum.yyy += cross * 3.0 * (a.y + b.y) * (a.y * a.y + b.y * b.y);
        }
        Self { xxx: sum.xxx / 60.0, xxy: sum.xxy / 60.0, xyy: sum.xyy / 60.0, yyy: sum.yyy / 60.0 }
    }

    /// ∫ q (qᵀ A q) dq for a symmetric A.
    pub fn against(&self, a: &Matrix2<f64>) -> Vector2<f64> {
        let along = |x, xy, y| a.m11 * x + 2.0 * a.m12 * xy + a.m22 * y;
        Vector2::new(along(self.xxx, self.xxy, self.xyy), along(self.xxy, self.xyy, self.yyy))
    }
}

/// 60 / cross · ∫ u²v over the triangle that (0, 0), (u, v) of one vertex and of the next span.
fn mixed(u: f64, v: f64, next_u: f64, next_v: f64) -> f64 {
    u * u * (3.0 * v + next_v) + 2.0 * u * next_u * (v + next_v) + next_u * next_u * (v + 3.0 * next_v)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_unit_square_has_the_textbook_moments() {
        let square = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(x, y)| Vector2::new(x, y));
        let moments = ThirdMoments::of(&square, Vector2::zeros());
        for (ours, exact) in [
            (moments.xxx, 1.0 / 4.0),
            (moments.xxy, 1.0 / 6.0),
            (moments.xyy, 1.0 / 6.0),
            (moments.yyy, 1.0 / 4.0),
        ] {
            assert!((ours - exact).abs() < 1e-15, "{ours} against {exact}");
        }
    }
}

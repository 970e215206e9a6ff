//! A quadratic picture of the sensory function: φ̂(q) = c + gᵀq + qᵀAq / 2, robot at the origin.

use nalgebra::{Matrix2, Vector2};

use crate::{
    centroid::Mass, estimate::LinearField, moments::Moments, polygon::edges, third_moments::ThirdMoments,
};

/// A quadratic estimate of φ around the robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct QuadraticField {
    /// Value and gradient at the robot.
    pub linear: LinearField,
    /// A, the second derivatives, per square meter, body frame; symmetric.
    pub curvature: Matrix2<f64>,
}

impl QuadraticField {
    /// φ̂ at a point of the body frame.
    pub fn at(&self, point: &Vector2<f64>) -> f64 {
        self.linear.at(point) + self.bend(point) / 2.0
    }

    /// The least φ̂ on a convex polygon: at a vertex, on an edge or at the stationary point inside.
    pub fn least(&self, polygon: &[Vector2<f64>]) -> f64 {
        let least =
            edges(polygon).map(|(start, end)| self.least_on(start, end)).fold(f64::INFINITY, f64::min);
        match self.bottom().filter(|bottom| contains(polygon, bottom)) {
            Some(bottom) => least.min(self.at(&bottom)),
            None => least,
        }
    }

    /// This estimate if it is negative nowhere on `polygon`, else raised by as much as it lacks.
    pub fn raised_on(&self, polygon: &[Vector2<f64>]) -> Self {
        let lacking = -self.least(polygon).min(0.0);
        Self { linear: LinearField { value: self.linear.value + lacking, ..self.linear }, ..*self }
    }

    /// Mass and centroid of `region` under φ̂, exactly; `None` if it holds no mass.
    ///
    /// The moments are taken about a vertex, as in [`crate::centroid::mass`].
    pub fn mass(&self, region: &[Vector2<f64>]) -> Option<Mass> {
        let about = *region.first()?;
        let (moments, third) = (Moments::of(region, about), ThirdMoments::of(region, about));
        let (value, slope) = (self.at(&about), self.slope(&about));
        let mass = value * moments.area
            + slope.dot(&moments.first)
            + self.curvature.component_mul(&moments.second).sum() / 2.0;
        let first = moments.first * value + moments.second * slope + third.against(&self.curvature) / 2.0;
        let centroid = about + first / mass;
        (mass > 0.0 && centroid.x.is_finite() && centroid.y.is_finite()).then_some(Mass { mass, centroid })
    }

    /// ∇φ̂ at a point.
    fn slope(&self, point: &Vector2<f64>) -> Vector2<f64> {
        self.linear.gradient + self.curvature * point
    }

    /// qᵀAq.
    fn bend(&self, along: &Vector2<f64>) -> f64 {
        along.dot(&(self.curvature * along))
    }

    fn least_on(&self, start: &Vector2<f64>, end: &Vector2<f64>) -> f64 {
        let along = end - start;
        let (down, bend) = (-self.slope(start).dot(&along), self.bend(&along));
        let least = self.at(start);
        if down > 0.0 && down < bend { least - down * down / (2.0 * bend) } else { least.min(self.at(end)) }
    }

    /// Where φ̂ stops falling, if it has a bottom.
    fn bottom(&self) -> Option<Vector2<f64>> {
        let convex = self.curvature.m11 > 0.0 && self.curvature.determinant() > 0.0;
        let inverse = self.curvature.try_inverse().filter(|_| convex)?;
        Some(-(inverse * self.linear.gradient))
    }
}

fn contains(polygon: &[Vector2<f64>], point: &Vector2<f64>) -> bool {
    edges(polygon).all(|(start, end)| (end - start).perp(&(point - start)) >= 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quadrature::integrate;

    fn polygon() -> [Vector2<f64>; 5] {
        [(-0.4, -0.5), (0.6, -0.3), (0.7, 0.4), (0.1, 0.8), (-0.5, 0.2)].map(|(x, y)| Vector2::new(x, y))
    }

    fn field(value: f64, xx: f64, xy: f64, yy: f64) -> QuadraticField {
        QuadraticField {
            linear: LinearField { value, gradient: Vector2::new(0.7, -0.4) },
            curvature: Matrix2::new(xx, xy, xy, yy),
        }
    }

    #[test]
    fn mass_and_centroid_are_those_of_quadrature() {
        let field = field(2.0, 1.5, 0.6, -0.8);
        let [mass, x, y] = integrate(&polygon(), |_, _| true, |q| [1.0, q.x, q.y].map(|k| k * field.at(&q)));
        let ours = field.mass(&polygon()).unwrap();
        assert!((ours.mass - mass).abs() < 1e-14, "{} against {mass}", ours.mass);
        assert!((ours.centroid - Vector2::new(x, y) / mass).norm() < 1e-14, "{}", ours.centroid);
    }

    #[test]
    fn the_least_value_is_found_inside_on_an_edge_and_at_a_vertex() {
        for (field, at) in [
            (field(2.0, 9.0, 0.0, 9.0), "inside"),
            (field(2.0, -1.0, 0.0, 3.0), "on an edge"),
            (field(2.0, -1.0, 0.2, -2.0), "at a vertex"),
        ] {
            let [a, b, c, d, e] = polygon();
            let mut sampled = f64::INFINITY;
            for (p, q, r) in [(a, b, c), (a, c, d), (a, d, e)] {
                for i in 0..=300 {
                    for j in 0..=300 - i {
                        let (s, t) = (f64::from(i) / 300.0, f64::from(j) / 300.0);
                        sampled = sampled.min(field.at(&(p + (q - p) * s + (r - p) * t)));
                    }
                }
            }
            let least = field.least(&polygon());
            assert!(least <= sampled && least > sampled - 1e-3, "{at}: {least} against {sampled}");
        }
    }

    #[test]
    fn raising_touches_zero_and_leaves_the_positive_alone() {
        let positive = field(2.0, 0.1, 0.0, 0.1);
        assert_eq!(positive.raised_on(&polygon()), positive);
        let negative = field(-1.0, 1.5, 0.6, -0.8);
        assert!(negative.raised_on(&polygon()).least(&polygon()).abs() < 1e-15);
    }
}

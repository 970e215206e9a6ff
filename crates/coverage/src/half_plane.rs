//! A straight line the robot must stay on its side of: a bisector, a wall or a closing line.

use core::f64::consts::TAU;

use nalgebra::Vector2;
use protocol::{
    percept::Wall,
    units::{Radians, wrapped},
};

/// All points r with r · normal <= distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HalfPlane {
    /// Bearing of the outward normal in (-π, π].
    pub bearing: f64,
    /// Unit outward normal.
    pub normal: Vector2<f64>,
    /// Distance of the line from the robot, meters; zero or more.
    pub distance: f64,
}

impl HalfPlane {
    /// The half-plane whose outward normal has `bearing`.
    pub fn new(bearing: f64, distance: f64) -> Self {
        let (sin, cos) = libm::sincos(bearing);
        Self { bearing: wrapped(bearing), normal: Vector2::new(cos, sin), distance }
    }

    /// The points nearer to the robot than to a neighbor at `range_m` under `bearing`.
    pub fn bisector(range_m: f64, bearing: Radians) -> Self {
        Self::new(bearing.get(), range_m / 2.0)
    }

    /// The inner side of a wall. A robot pressed through its wall counts as standing on it.
    pub fn wall(wall: &Wall) -> Self {
        Self::new(wall.bearing.get(), wall.distance.get().max(0.0))
    }

    /// Counter-clockwise angle from this normal to the next one, in [0, 2π).
    pub fn gap_to(&self, next: &Self) -> f64 {
        let gap = next.bearing - self.bearing;
        if gap < 0.0 { gap + TAU } else { gap }
    }

    /// Where the two boundary lines cross. Far away, or not finite, if they are nearly parallel;
    /// what rounding does there moves the point along the line and not off it.
    pub fn crossing(&self, other: &Self) -> Vector2<f64> {
        let (cos, sin) = (self.normal.dot(&other.normal), self.normal.perp(&other.normal));
        let along = (other.distance - self.distance * cos) / sin;
        self.normal * self.distance + Vector2::new(-self.normal.y, self.normal.x) * along
    }
}

#[cfg(test)]
mod tests {
    use core::f64::consts::PI;

    use super::*;

    #[test]
    fn perpendicular_lines_cross_where_one_expects() {
        let east = HalfPlane::new(0.0, 2.0);
        let north = HalfPlane::new(PI / 2.0, 3.0);
        assert!((east.crossing(&north) - Vector2::new(2.0, 3.0)).norm() < 1e-15);
    }
}

//! The arena's frame: origin in the lower left corner, x along the lower wall, meters.
//!
//! These types exist in this crate alone: a robot cannot name a point of the arena, but for its own position where a
//! scenario grants it.

use nalgebra::Vector2;
use protocol::{
    frame::BodyVector,
    granted::{Compass, Position},
    odometry::Motion,
    units::{Meters, Radians, wrapped},
};

/// A point of the arena, meters.
pub type ArenaPoint = Vector2<f64>;

/// Where a body is and which way it faces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Center of the body.
    pub position: ArenaPoint,
    /// Heading in radians, counter-clockwise from the arena's x axis, in (-π, π].
    pub heading: f64,
}

impl Pose {
    /// A pose in the arena's own axes: its body frame is the arena's, moved to `position`.
    pub fn unturned(position: ArenaPoint) -> Self {
        Self { position, heading: 0.0 }
    }

    /// A point of the arena as this body sees it.
    pub fn sees(&self, point: ArenaPoint) -> BodyVector {
        let (sin, cos) = libm::sincos(self.heading);
        let away = point - self.position;
        BodyVector::new(cos * away.x + sin * away.y, cos * away.y - sin * away.x)
    }

    /// This pose as a body at `other` sees it: the motion that leads here from there.
    pub fn seen_from(&self, other: &Self) -> Motion {
        Motion { displacement: other.sees(self.position), turn: wrapped(self.heading - other.heading) }
    }

    /// Returns what a compass reads here.
    pub fn compass(&self) -> Compass {
        Compass { heading: Radians::new(self.heading).expect("poses are finite") }
    }

    /// Returns the position as a robot that is told reads it.
    pub fn told(&self) -> Position {
        let [x, y] = [self.position.x, self.position.y].map(|at| Meters::new(at).expect("poses are finite"));
        Position { x, y }
    }

    /// A vector of this body in the arena's axes.
    pub fn outward(&self, vector: BodyVector) -> Vector2<f64> {
        let (sin, cos) = libm::sincos(self.heading);
        Vector2::new(cos * vector.0.x - sin * vector.0.y, sin * vector.0.x + cos * vector.0.y)
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    #[test]
    fn what_lies_north_of_a_robot_facing_north_is_ahead() {
        let pose = Pose { position: Vector2::new(1.0, 1.0), heading: PI / 2.0 };
        let seen = pose.sees(Vector2::new(1.0, 3.0));
        assert!((seen.0 - Vector2::new(2.0, 0.0)).norm() < 1e-15);
        assert!((pose.outward(seen) - Vector2::new(0.0, 2.0)).norm() < 1e-15);
    }
}

//! The body frame: the only frame a robot knows.
//!
//! Origin at the robot, x straight ahead, y to its left, meters. There is no type for a point of
//! the arena in this crate on purpose: a robot cannot even name one.

use nalgebra::Vector2;

use crate::units::{Meters, Radians};

/// A vector in the body frame: a displacement (m), a velocity (m/s) or a gradient (1/m).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BodyVector(pub Vector2<f64>);

impl BodyVector {
    /// No displacement: the robot's own position, seen from itself.
    pub const HERE: Self = Self(Vector2::new(0.0, 0.0));

    /// From components along the body's x and y axes.
    pub const fn new(x: f64, y: f64) -> Self {
        Self(Vector2::new(x, y))
    }

    /// The point at `range` under `bearing`.
    pub fn polar(range: Meters, bearing: Radians) -> Self {
        let (sin, cos) = libm::sincos(bearing.get());
        Self(Vector2::new(range.get() * cos, range.get() * sin))
    }

    /// Euclidean length.
    pub fn length(self) -> f64 {
        libm::hypot(self.0.x, self.0.y)
    }

    /// Bearing in (-π, π]; 0 for the zero vector.
    pub fn bearing(self) -> f64 {
        libm::atan2(self.0.y, self.0.x)
    }

    /// The same vector turned by `angle` radians, counter-clockwise.
    pub fn turned(self, angle: f64) -> Self {
        let (sin, cos) = libm::sincos(angle);
        Self(Vector2::new(cos * self.0.x - sin * self.0.y, sin * self.0.x + cos * self.0.y))
    }

    /// The same direction, no longer than `limit`.
    pub fn capped(self, limit: f64) -> Self {
        let length = self.length();
        if length > limit { Self(self.0 * (limit / length)) } else { self }
    }

    /// True if both components are finite.
    pub fn is_finite(self) -> bool {
        self.0.x.is_finite() && self.0.y.is_finite()
    }
}

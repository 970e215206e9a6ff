//! The robot's picture of the sensory function: φ̂(q) = φ(p) + ∇φ · (q − p) (eq. 13), here with
//! p = 0, so c1 = φ(p) and the gradient is [c2 c3]ᵀ.

use nalgebra::Vector2;
use protocol::{
    frame::BodyVector,
    percept::{Light, Stimulus},
    units::Meters,
};
use serde::{Deserialize, Serialize};

use crate::polygon::{Polygon, clip};

/// How the robot gets the gradient of φ.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum GradientMode {
    /// As its sensor measures it (Section IV).
    Measured,
    /// A fixed magnitude, per meter, towards the stimulus (Section V).
    Fixed(f64),
}

/// An affine estimate of φ around the robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinearField {
    /// φ at the robot.
    pub value: f64,
    /// Gradient per meter, body frame.
    pub gradient: Vector2<f64>,
}

impl LinearField {
    /// φ ≡ 1: every place matters the same.
    pub const UNIFORM: Self = Self { value: 1.0, gradient: Vector2::new(0.0, 0.0) };

    /// From what the light sensors say. In darkness, or where a mode needs a magnitude the sensor
    /// does not give, the gradient is zero and the estimate is flat.
    pub fn sensed(light: &Light, mode: GradientMode) -> Self {
        let gradient = match (mode, light.stimulus) {
            (GradientMode::Measured, Stimulus::Gradient(gradient)) => gradient,
            (GradientMode::Fixed(per_m), Stimulus::Gradient(gradient)) => match gradient.length() {
                0.0 => BodyVector::HERE,
                length => BodyVector(gradient.0 * (per_m / length)),
            },
            (GradientMode::Fixed(per_m), Stimulus::Bearing(bearing)) => {
                let unit = BodyVector::polar(Meters::new(1.0).expect("1 is finite"), bearing);
                BodyVector(unit.0 * per_m)
            }
            (GradientMode::Measured, Stimulus::Bearing(_)) | (_, Stimulus::None) => BodyVector::HERE,
        };
        Self { value: light.value, gradient: gradient.0 }
    }

    /// φ̂ at a point of the body frame.
    pub fn at(&self, point: &Vector2<f64>) -> f64 {
        self.value + self.gradient.dot(point)
    }

    /// V+: the part of a cell where φ̂ is not negative (eq. 12); empty if that has no area. Most of the time it is the
    /// cell itself, which then need not be copied; else it is written over `part`.
    pub fn positive_part<'a>(&self, cell: &'a [Vector2<f64>], part: &'a mut Polygon) -> &'a [Vector2<f64>] {
        if cell.len() >= 3 && cell.iter().all(|vertex| self.at(vertex) >= 0.0) {
            return cell;
        }
        clip(part, cell, |vertex| self.at(vertex));
        part
    }
}

#[cfg(test)]
mod tests {
    use protocol::units::Radians;

    use super::*;

    #[test]
    fn a_bearing_gets_the_fixed_magnitude() {
        let light = Light { value: 5.0, stimulus: Stimulus::Bearing(Radians::new(0.0).unwrap()) };
        let field = LinearField::sensed(&light, GradientMode::Fixed(1000.0));
        assert_eq!(field, LinearField { value: 5.0, gradient: Vector2::new(1000.0, 0.0) });
    }

    #[test]
    fn a_bearing_alone_measures_no_gradient() {
        let light = Light { value: 5.0, stimulus: Stimulus::Bearing(Radians::new(1.0).unwrap()) };
        assert_eq!(LinearField::sensed(&light, GradientMode::Measured).gradient, Vector2::zeros());
    }

    #[test]
    fn darkness_has_no_direction() {
        let light = Light { value: 0.0, stimulus: Stimulus::Gradient(BodyVector::HERE) };
        assert_eq!(LinearField::sensed(&light, GradientMode::Fixed(1000.0)).gradient, Vector2::zeros());
    }
}

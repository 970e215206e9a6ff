//! The true sensory function φ, term by term.
//!
//! A robot meets it only under the `exact` controller, in its own body frame; the arena evaluates
//! the same terms in its frame. The formulas do not care which frame a point is in, as long as
//! component and point share it.

use nalgebra::Vector2;
use protocol::percept::FieldComponent;

/// φ at a point: the sum of its components.
pub fn value(field: &[FieldComponent], at: Vector2<f64>) -> f64 {
    field.iter().map(|component| component_value(component, at)).sum()
}

/// ∇φ at a point, per meter.
pub fn gradient(field: &[FieldComponent], at: Vector2<f64>) -> Vector2<f64> {
    field.iter().map(|component| component_gradient(component, at)).sum()
}

/// |term| at a point. It falls with the distance from the term's peak, or is the same everywhere.
pub fn magnitude(component: &FieldComponent, at: Vector2<f64>) -> f64 {
    component_value(component, at).abs()
}

/// Where a term is largest, and its magnitude there; `None` for a constant.
pub fn peak_of(component: &FieldComponent) -> Option<(Vector2<f64>, f64)> {
    match component {
        FieldComponent::Constant(_) => None,
        FieldComponent::Gaussian { center, amplitude, .. } => Some((center.0, amplitude.abs())),
        FieldComponent::Lamp { position, peak, .. } => Some((position.0, peak.abs())),
    }
}

fn component_value(component: &FieldComponent, at: Vector2<f64>) -> f64 {
    match component {
        FieldComponent::Constant(value) => *value,
        FieldComponent::Gaussian { center, amplitude, sigma_m } => {
            amplitude * libm::exp(-(at - center.0).norm_squared() / (2.0 * sigma_m * sigma_m))
        }
        FieldComponent::Lamp { position, peak, half_distance_m } => {
            peak / (1.0 + (at - position.0).norm_squared() / (half_distance_m * half_distance_m))
        }
    }
}

fn component_gradient(component: &FieldComponent, at: Vector2<f64>) -> Vector2<f64> {
    match component {
        FieldComponent::Constant(_) => Vector2::zeros(),
        FieldComponent::Gaussian { center, sigma_m, .. } => {
            (center.0 - at) * (component_value(component, at) / (sigma_m * sigma_m))
        }
        FieldComponent::Lamp { position, peak, half_distance_m } => {
            let (away, h_squared) = (position.0 - at, half_distance_m * half_distance_m);
            let falloff = 1.0 + away.norm_squared() / h_squared;
            away * (2.0 * peak / (h_squared * falloff * falloff))
        }
    }
}

#[cfg(test)]
mod tests {
    use protocol::frame::BodyVector;

    use super::*;

    #[test]
    fn gradients_agree_with_finite_differences() {
        let field = [
            FieldComponent::Constant(3.0),
            FieldComponent::Gaussian { center: BodyVector::new(0.2, 0.1), amplitude: 2.0, sigma_m: 0.4 },
            FieldComponent::Lamp { position: BodyVector::new(-0.3, 0.5), peak: 7.0, half_distance_m: 0.5 },
        ];
        let (at, h) = (Vector2::new(0.4, -0.3), 1e-6);
        let slope = |step: Vector2<f64>| (value(&field, at + step) - value(&field, at - step)) / (2.0 * h);
        let numeric = Vector2::new(slope(Vector2::new(h, 0.0)), slope(Vector2::new(0.0, h)));
        assert!((gradient(&field, at) - numeric).norm() < 1e-8);
    }

    #[test]
    fn half_the_peak_is_left_at_the_half_distance() {
        let lamp = [FieldComponent::Lamp { position: BodyVector::HERE, peak: 500.0, half_distance_m: 0.5 }];
        assert_eq!(value(&lamp, Vector2::new(0.0, 0.5)), 250.0);
    }
}

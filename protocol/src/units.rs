//! Physical quantities as types: finite by construction, so no later stage has to ask again.
//!
//! Use them in signatures; inside the arithmetic use plain `f64` with the unit last (`range_m`).

use core::f64::consts::{PI, TAU};

use serde::{Deserialize, Serialize};

/// Why a number is not a quantity.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("{value} is not a finite number of {unit}")]
pub struct NotFinite {
    /// The number that was refused.
    pub value: f64,
    /// The unit it should have been in, for the message.
    pub unit: &'static str,
}

macro_rules! quantity {
    ($(#[$doc:meta])* $name:ident, $unit:literal) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, PartialOrd, Serialize, Deserialize)]
        #[serde(try_from = "f64", into = "f64")]
        pub struct $name(f64);

        impl $name {
            /// `None` for NaN and infinities.
            pub const fn new(value: f64) -> Option<Self> {
                if value.is_finite() { Some(Self(value)) } else { None }
            }

            /// The plain number.
            pub const fn get(self) -> f64 {
                self.0
            }
        }

        impl TryFrom<f64> for $name {
            type Error = NotFinite;

            fn try_from(value: f64) -> Result<Self, NotFinite> {
                Self::new(value).ok_or(NotFinite { value, unit: $unit })
            }
        }

        impl From<$name> for f64 {
            fn from(quantity: $name) -> f64 {
                quantity.0
            }
        }
    };
}

quantity!(
    /// A length in meters.
    Meters,
    "meters"
);
quantity!(
    /// An angle in radians, counter-clockwise from the body's x axis (straight ahead).
    Radians,
    "radians"
);
quantity!(
    /// A duration of virtual time in seconds.
    Seconds,
    "seconds"
);
quantity!(
    /// A speed in meters per second.
    MetersPerSecond,
    "meters per second"
);

/// The same angle in (-π, π].
pub fn wrapped(angle: f64) -> f64 {
    if angle > -PI && angle <= PI {
        return angle;
    }
    let turned = angle - TAU * libm::floor(angle / TAU);
    if turned > PI { turned - TAU } else { turned }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quantity_is_never_nan_or_infinite() {
        assert_eq!(Meters::new(f64::NAN), None);
        assert_eq!(Radians::new(f64::INFINITY), None);
        assert_eq!(Meters::new(-0.5).map(Meters::get), Some(-0.5));
    }

    #[test]
    fn angles_wrap_into_one_turn() {
        assert_eq!(wrapped(PI), PI);
        assert!((wrapped(-PI) - PI).abs() < 1e-15);
        assert!((wrapped(7.0) - (7.0 - TAU)).abs() < 1e-15);
        assert!((wrapped(-20.0) - (-20.0 + 3.0 * TAU)).abs() < 1e-14);
    }
}

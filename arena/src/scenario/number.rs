//! Numbers as a scenario file may hold them: checked while the file is read, so an error knows its line.
//!
//! TOML allows `nan` and `inf`; none of these types does. Integers are accepted where a number is asked.

use std::borrow::Cow;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize};

/// Most robots a scenario may ask for: keeps a typing slip from asking for the whole machine.
pub const MAX_ROBOTS: u32 = 1_000_000;

/// Why a number was refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("must be {wanted}, got {got}")]
pub struct Refused {
    wanted: Cow<'static, str>,
    got: String,
}

/// A constant of its kind, or the crate does not compile.
macro_rules! constant {
    ($kind:ident, $value:literal) => {
        const { $kind::new($value).expect("the constant is of its kind") }
    };
}

macro_rules! number {
    ($(#[$doc:meta])* $name:ident, $wanted:literal, $value:ident => $accepted:expr, $schema:tt) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, PartialOrd, Serialize, Deserialize)]
        #[serde(try_from = "f64", into = "f64")]
        pub struct $name(f64);

        impl $name {
            /// `None` if the number is not of this kind.
            pub const fn new($value: f64) -> Option<Self> {
                if $value.is_finite() && $accepted { Some(Self($value)) } else { None }
            }

            /// The plain number.
            pub const fn get(self) -> f64 {
                self.0
            }
        }

        impl TryFrom<f64> for $name {
            type Error = Refused;

            fn try_from(value: f64) -> Result<Self, Refused> {
                let wanted = if value.is_finite() { $wanted } else { "a finite number" };
                Self::new(value).ok_or_else(|| Refused { wanted: wanted.into(), got: value.to_string() })
            }
        }

        impl From<$name> for f64 {
            fn from(number: $name) -> f64 {
                number.0
            }
        }

        impl JsonSchema for $name {
            fn schema_name() -> Cow<'static, str> {
                stringify!($name).into()
            }

            fn inline_schema() -> bool {
                true
            }

            fn json_schema(_: &mut SchemaGenerator) -> Schema {
                json_schema!($schema)
            }
        }
    };
}

number!(
    /// A number above zero.
    Positive,
    "a positive number",
    value => value > 0.0,
    { "type": "number", "exclusiveMinimum": 0 }
);
number!(
    /// A number, zero or more.
    NonNegative,
    "zero or a positive number",
    value => value >= 0.0,
    { "type": "number", "minimum": 0 }
);
number!(
    /// A chance: from 0 to 1.
    Probability,
    "a probability from 0 to 1",
    value => value >= 0.0 && value <= 1.0,
    { "type": "number", "minimum": 0, "maximum": 1 }
);
number!(
    /// Part of a whole: above 0, at most 1.
    Share,
    "a share above 0, at most 1",
    value => value > 0.0 && value <= 1.0,
    { "type": "number", "exclusiveMinimum": 0, "maximum": 1 }
);
number!(
    /// Any number but NaN and the infinities.
    Finite,
    "a finite number",
    value => true,
    { "type": "number" }
);

macro_rules! count {
    ($(#[$doc:meta])* $name:ident, $things:literal, $least:expr, $most:expr) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
        #[serde(try_from = "i64", into = "u32")]
        pub struct $name(u32);

        impl $name {
            /// `None` for fewer or more than that.
            pub const fn new(count: u32) -> Option<Self> {
                if $least <= count && count <= $most { Some(Self(count)) } else { None }
            }

            /// The plain count.
            pub const fn get(self) -> u32 {
                self.0
            }
        }

        impl TryFrom<i64> for $name {
            type Error = Refused;

            fn try_from(count: i64) -> Result<Self, Refused> {
                u32::try_from(count).ok().and_then(Self::new).ok_or_else(|| Refused {
                    wanted: format!("from {} to {} {}", $least, $most, $things).into(),
                    got: count.to_string(),
                })
            }
        }

        impl From<$name> for u32 {
            fn from(count: $name) -> u32 {
                count.0
            }
        }

        impl JsonSchema for $name {
            fn schema_name() -> Cow<'static, str> {
                stringify!($name).into()
            }

            fn inline_schema() -> bool {
                true
            }

            fn json_schema(_: &mut SchemaGenerator) -> Schema {
                json_schema!({ "type": "integer", "minimum": $least, "maximum": $most })
            }
        }
    };
}

count!(
    /// How many robots: from 1 to [`MAX_ROBOTS`].
    RobotCount,
    "robots",
    1,
    MAX_ROBOTS
);
count!(
    /// How many photodiodes: two tell no direction, 64 are more than any robot has.
    DiodeCount,
    "diodes",
    3,
    64
);
count!(
    /// How many bits of a packet are flipped: at most all of them.
    FlipCount,
    "bits",
    1,
    8 * protocol::packet::LOCALIZATION_BYTES as u32
);
count!(
    /// How many faults a random plan may have.
    FaultCount,
    "faults",
    1,
    64
);

/// Two numbers along the arena's axes, written `[x, y]`.
///
/// A type of its own because a plain `[T; 2]` would read `[1, 2, 3]` and forget the third.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Vec<T>", into = "[T; 2]", bound(serialize = "T: Copy + Serialize"))]
pub struct Xy<T> {
    /// Along the lower wall.
    pub x: T,
    /// Along the left wall.
    pub y: T,
}

impl<T: Copy + Into<f64>> Xy<T> {
    /// The plain numbers.
    pub fn get(self) -> [f64; 2] {
        [self.x.into(), self.y.into()]
    }
}

impl<T> TryFrom<Vec<T>> for Xy<T> {
    type Error = Refused;

    fn try_from(numbers: Vec<T>) -> Result<Self, Refused> {
        let [x, y] = <[T; 2]>::try_from(numbers).map_err(|numbers| Refused {
            wanted: "a pair of numbers [x, y]".into(),
            got: format!("{} of them", numbers.len()),
        })?;
        Ok(Self { x, y })
    }
}

impl<T> From<Xy<T>> for [T; 2] {
    fn from(pair: Xy<T>) -> [T; 2] {
        [pair.x, pair.y]
    }
}

impl<T: JsonSchema> JsonSchema for Xy<T> {
    fn schema_name() -> Cow<'static, str> {
        format!("Xy_of_{}", T::schema_name()).into()
    }

    fn inline_schema() -> bool {
        true
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        <[T; 2]>::json_schema(generator)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_number_is_nan_or_infinite() {
        for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert_eq!(Positive::new(value), None);
            assert_eq!(NonNegative::new(value), None);
            assert_eq!(Finite::new(value), None);
        }
    }

    #[test]
    fn zero_is_non_negative_but_not_positive() {
        assert_eq!(Positive::new(0.0), None);
        assert_eq!(NonNegative::new(0.0).map(NonNegative::get), Some(0.0));
    }

    #[test]
    fn a_robot_count_is_bounded_at_both_ends() {
        assert_eq!(RobotCount::new(0), None);
        assert_eq!(RobotCount::new(MAX_ROBOTS).map(RobotCount::get), Some(MAX_ROBOTS));
        assert_eq!(RobotCount::new(MAX_ROBOTS + 1), None);
    }
}

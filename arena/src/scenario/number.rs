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
    /// Any number but NaN and the infinities.
    Finite,
    "a finite number",
    value => true,
    { "type": "number" }
);

/// How many robots: from 1 to [`MAX_ROBOTS`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(try_from = "i64", into = "u32")]
pub struct RobotCount(u32);

impl RobotCount {
    /// `None` for 0 and for more than [`MAX_ROBOTS`].
    pub const fn new(count: u32) -> Option<Self> {
        if 1 <= count && count <= MAX_ROBOTS { Some(Self(count)) } else { None }
    }

    /// The plain count.
    pub const fn get(self) -> u32 {
        self.0
    }
}

impl TryFrom<i64> for RobotCount {
    type Error = Refused;

    fn try_from(count: i64) -> Result<Self, Refused> {
        u32::try_from(count).ok().and_then(Self::new).ok_or_else(|| Refused {
            wanted: format!("from 1 to {MAX_ROBOTS} robots").into(),
            got: count.to_string(),
        })
    }
}

impl From<RobotCount> for u32 {
    fn from(count: RobotCount) -> u32 {
        count.0
    }
}

impl JsonSchema for RobotCount {
    fn schema_name() -> Cow<'static, str> {
        "RobotCount".into()
    }

    fn inline_schema() -> bool {
        true
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "type": "integer", "minimum": 1, "maximum": MAX_ROBOTS })
    }
}

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

//! Numbers as a scenario file may hold them: checked while the file is read, so an error knows its line.
//!
//! TOML allows `nan` and `inf`; none of these types does. Integers are accepted where a number is asked.

use std::borrow::Cow;
use std::fmt;
use std::str::FromStr;

use protocol::payload::{PAYLOAD_BYTES_MAX, SHORT_PAYLOAD_BYTES};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize, Serializer};

/// Most robots a scenario may ask for: keeps a typing slip from asking for the whole machine.
pub const MAX_ROBOTS: u32 = 1_000_000;

/// Highest seed, 2^53 − 1. Up to it whole numbers survive every reader of our files: JavaScript and jq take the numbers
/// of JSON for 64-bit floating point, and TOML's whole numbers end at 2^63 − 1.
pub const SEED_MAX: u64 = (1 << 53) - 1;

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
    ($(#[$doc:meta])* $name:ident: $int:ty, $least:expr, $most:expr, $things:literal) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
        #[serde(try_from = "i128")]
        pub struct $name($int);

        impl $name {
            /// `None` for fewer or more than that.
            pub const fn new(count: $int) -> Option<Self> {
                if $least as i128 <= count as i128 && count <= $most { Some(Self(count)) } else { None }
            }

            /// The plain number.
            pub const fn get(self) -> $int {
                self.0
            }

            fn wanted() -> Cow<'static, str> {
                format!(concat!("from {} to {}", $things), $least, $most).into()
            }
        }

        // Wider than any of them, so that a number out of bounds is refused with the bounds.
        impl TryFrom<i128> for $name {
            type Error = Refused;

            fn try_from(count: i128) -> Result<Self, Refused> {
                <$int>::try_from(count)
                    .ok()
                    .and_then(Self::new)
                    .ok_or_else(|| Refused { wanted: Self::wanted(), got: count.to_string() })
            }
        }

        impl Serialize for $name {
            fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                self.0.serialize(serializer)
            }
        }

        impl From<$name> for $int {
            fn from(count: $name) -> $int {
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
    RobotCount: u32,
    1,
    MAX_ROBOTS,
    " robots"
);
count!(
    /// How many photodiodes: two tell no direction, 64 are more than any robot has.
    DiodeCount: u32,
    3,
    64,
    " diodes"
);
count!(
    /// How many bits of a packet are flipped: at most all of one with a light reading.
    FlipCount: u32,
    1,
    8 * protocol::packet::frame_bytes(4) as u32,
    " bits"
);
count!(
    /// How many bytes of a payload.
    PayloadBytes: u8,
    0,
    PAYLOAD_BYTES_MAX as u8,
    " bytes"
);

/// As many as cost nothing.
impl Default for PayloadBytes {
    fn default() -> Self {
        Self(SHORT_PAYLOAD_BYTES as u8)
    }
}

count!(
    /// How many faults a random plan may have.
    FaultCount: u32,
    1,
    64,
    " faults"
);
count!(
    /// A seed of random draws: from 0 to [`SEED_MAX`].
    Seed: u64,
    0,
    SEED_MAX,
    ""
);

impl Seed {
    /// The seed so many after this one; `None` beyond [`SEED_MAX`].
    pub fn after(self, count: u64) -> Option<Self> {
        self.0.checked_add(count).and_then(Self::new)
    }
}

impl fmt::Display for Seed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

impl FromStr for Seed {
    type Err = Refused;

    fn from_str(text: &str) -> Result<Self, Refused> {
        let seed = text.parse().ok().and_then(Self::new);
        seed.ok_or_else(|| Refused { wanted: Self::wanted(), got: text.into() })
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

    #[test]
    fn seeds_end_where_floating_point_ceases_to_count() {
        assert_ne!(SEED_MAX as f64, (SEED_MAX + 1) as f64);
        assert_eq!((SEED_MAX + 1) as f64, (SEED_MAX + 2) as f64);
        let highest = Seed::new(SEED_MAX);
        assert_eq!(highest.and_then(|seed| seed.after(0)), highest);
        assert_eq!(highest.and_then(|seed| seed.after(1)), None);
        assert_eq!(Seed::new(1).and_then(|seed| seed.after(u64::MAX)), None);
    }
}

//! Readings that tell a robot which way it faces in the arena, or where it is: only where a scenario grants them.
//!
//! The arena's frame has its origin in the lower left corner and its x axis along the lower wall. No other type that a
//! robot is told anything by knows it.

use crate::units::{Meters, Radians};

/// A compass's reading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Compass {
    /// Heading of the body in the arena's frame, counter-clockwise from its x axis, in (-π, π].
    pub heading: Radians,
}

/// A position's reading, as of satellites or cameras.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Position {
    /// Center of the body along the arena's x axis.
    pub x: Meters,
    /// Center of the body along the arena's y axis.
    pub y: Meters,
}

//! Parameters of the controller: the same for every robot that they are given to, and silent about how many there are.

use protocol::units::{Meters, MetersPerSecond};
use serde::{Deserialize, Serialize};

use crate::law::Law;

/// How the robot gets the gradient of φ.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum GradientMode {
    /// As its sensor measures it (Section IV).
    Measured,
    /// A fixed magnitude, per meter, towards the stimulus (Section V).
    Fixed(f64),
}

/// How to close a cell that neighbors and walls leave open (Section V.B, Fig. 6).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Closure {
    /// Base of the isosceles triangle for a single bearing.
    pub triangle_base: Meters,
    /// Height of that triangle.
    pub triangle_height: Meters,
    /// Distance of the line that closes a gap of π or more.
    pub close_distance: Meters,
    /// Apothem of the regular 24-gon that every cell is cut to, if any.
    pub cap: Option<Meters>,
}

/// Parameters of a robot's controller.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CoverageSetup {
    /// Control law.
    pub law: Law,
    /// Gain k of eq. 8, per second.
    pub gain_per_s: f64,
    /// Cap on the commanded speed, if any.
    pub speed_cap: Option<MetersPerSecond>,
    /// Source of the gradient.
    pub gradient: GradientMode,
    /// Closing rules.
    pub closure: Closure,
    /// A neighbor counts while it was heard less than this many ticks ago; at least 1.
    pub neighbor_timeout_ticks: u32,
}

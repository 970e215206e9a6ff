//! Closing a cell that neighbors and walls leave open (Section V.B of the paper, Fig. 6).
//!
//! 1. no line at all: no cell, the robot stays;
//! 2. all lines on one bearing: an isosceles triangle of constant size, its base on the nearest
//!    bisector, its apex behind the robot;
//! 3. a gap of π or more between consecutive bearings: the half-plane r · b <= close distance,
//!    b the middle of the gap. Two exactly opposite neighbors have two such gaps.
//!
//! A gap just under π is formally bounded and can still reach hundreds of meters: the optional cap
//! (a regular 24-gon) holds that, and the speed cap.

use core::{
    f64::consts::{PI, TAU},
    mem,
};

use arrayvec::ArrayVec;
use nalgebra::Vector2;
use protocol::units::Meters;
use serde::{Deserialize, Serialize};

use crate::{
    half_plane::HalfPlane,
    polygon::{self, CAP_SIDES, CLOSING_LINES_MAX, Polygon},
};

/// Bearings count as opposite, or as the same, within this angle in radians.
pub const GAP_EPSILON: f64 = 1e-9;

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

/// How the bearings of the known half-planes lie around the robot.
#[derive(Clone, Debug, PartialEq)]
pub enum Opening {
    /// They all share one bearing.
    OneBearing,
    /// Lines that close the gaps of π or more; none if the cell is bounded.
    Gaps(ArrayVec<HalfPlane, CLOSING_LINES_MAX>),
}

/// Looks for gaps among `lines`, which are sorted by bearing and not empty.
pub fn opening(lines: &[HalfPlane], closure: &Closure) -> Opening {
    let mut closing = ArrayVec::new();
    for (line, next) in lines.iter().zip(lines[1..].iter().chain(&lines[..1])) {
        let gap = if lines.len() == 1 { TAU } else { line.gap_to(next) };
        if gap >= TAU - GAP_EPSILON {
            return Opening::OneBearing;
        }
        if gap >= PI - GAP_EPSILON {
            closing.push(HalfPlane::new(line.bearing + gap / 2.0, closure.close_distance.get()));
        }
    }
    // Lines that agree to the last bit have no gap between them, and no gap around them either.
    if lines.iter().all(|line| line.bearing == lines[0].bearing) {
        return Opening::OneBearing;
    }
    Opening::Gaps(closing)
}

/// The triangle of rule 2 behind the nearest line.
pub fn triangle(nearest: &HalfPlane, closure: &Closure) -> [Vector2<f64>; 3] {
    let towards = nearest.normal;
    let base_center = towards * nearest.distance;
    let half_base = Vector2::new(-towards.y, towards.x) * (closure.triangle_base.get() / 2.0);
    let apex = base_center - towards * closure.triangle_height.get();
    [apex, base_center - half_base, base_center + half_base]
}

/// Cuts a cell to the cap, if there is one and it bites.
pub fn cap(cell: &mut Polygon, closure: &Closure) {
    let Some(cap) = closure.cap.map(|cap| cap.get()) else { return };
    if polygon::reach(cell) <= cap {
        return;
    }
    // From one polygon to the other and back: after an even number of cuts the last one is in `cell`.
    const { assert!(CAP_SIDES.is_multiple_of(2)) };
    let mut spare = Polygon::new();
    let (mut from, mut to) = (cell, &mut spare);
    for side in 0..CAP_SIDES {
        let line = HalfPlane::new(TAU * side as f64 / CAP_SIDES as f64, cap);
        polygon::clip(to, from, |v| line.distance - v.dot(&line.normal));
        mem::swap(&mut from, &mut to);
    }
}

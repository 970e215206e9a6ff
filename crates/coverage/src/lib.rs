//! The paper's controller of one robot: pure, `no_std`, no allocation.
//!
//! Read `step` of [`CoverageController`] first; it reads from top to bottom like Algorithm 1 of the paper:
//! M. Schwager, J. McLurkin, D. Rus, "Distributed Coverage Control with Sensory Feedback for
//! Networked Robots", RSS 2006. Everything here is in the body frame (robot at the origin, x
//! ahead), so p = 0 throughout and nothing is lost to large coordinates.
//!
//! ```text
//! deliveries -> neighbors -> half-planes -> cell (closure) -> V+ (estimate) -> moments -> centroid
//! ```

#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

pub mod cell;
pub mod centroid;
pub mod closure;
pub mod control_law;
pub mod controller;
pub mod estimate;
pub mod fit;
pub mod half_plane;
pub mod law;
pub mod moments;
pub mod neighbors;
pub mod polygon;
pub mod quadratic_field;
pub mod quadrature;
pub mod reading;
pub mod refinement;
pub mod sensory_field;
pub mod setup;
pub mod third_moments;

pub use controller::CoverageController;

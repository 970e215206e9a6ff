//! The world, the infrared and the lamps: pure and deterministic.
//!
//! Read [`Arena::tick`] first: commands in, percepts out. Nothing here knows a clock, a thread, a
//! file, a socket or a process; randomness is a draw keyed by what it is for, so adding a robot
//! leaves the others' draws alone.

#![forbid(unsafe_code)]

pub mod arena;
pub mod channel;
mod contacts;
mod delaunay;
pub mod digest;
pub mod executor;
pub mod fault;
pub mod field;
pub mod frame;
mod grid;
pub mod index_lists;
pub mod light;
pub mod losses;
pub mod measurement;
pub mod metrics;
pub mod neighbor_tables;
pub mod odometry;
pub mod packets;
pub mod payloads;
pub mod placement;
pub mod plan_warnings;
pub mod random;
pub mod voronoi;
pub mod world;

pub use arena::Arena;

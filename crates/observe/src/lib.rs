//! Observers of a run, one module each: what is shown of it, kept of it, and drawn from it.
//!
//! Each is an [`Observer`](engine::Observer), which the program that puts a run together hands to the loop. None of
//! them knows the squad: whatever runs the robots, they are told the same.

#![forbid(unsafe_code)]

pub mod agents;
pub mod convergence;
pub mod live;
pub mod log_context;
mod messages;
pub mod outputs;
pub mod progress;
pub mod recorder;
pub mod recovery;
pub mod trace;
pub mod trial;

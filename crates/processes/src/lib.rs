//! Processes of this machine: their state, and the signals by which they are asked to end or to stand still.

#![forbid(unsafe_code)]

mod process;
pub mod signals;

pub use process::{Process, State};

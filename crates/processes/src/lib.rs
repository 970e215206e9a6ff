//! Processes of this machine: their state, what they take, and the signals by which they are asked to end or to stand still.

#![forbid(unsafe_code)]

pub mod cpu;
mod process;
pub mod signals;

pub use process::{Process, State};

//! The extension module of the Python package `lamplight`: percepts and commands as Python sees them, and the agent that
//! has a controller in Python.
//!
//! A user imports the package in `lamplight/` beside this; it adds what is better said in Python.

#![deny(unsafe_code)]

mod agent;
mod arrays;
mod command;
mod controller;
mod in_process;
mod percept;
mod property;

use pyo3::pymodule;

/// Percepts, commands and agents, made in Rust.
#[pymodule]
mod _lamplight {
    #[pymodule_export]
    use crate::{
        agent::{die_with_parent, run_agent},
        arrays::{NeighborRows, WallRows},
        command::Command,
        in_process::command,
        percept::{Compass, Light, Odometry, Percept, Position},
        property::{always, sometimes},
    };

    /// Version of the package, and of the programs that it fits.
    #[pymodule_export]
    #[allow(non_upper_case_globals, reason = "it is Python's name for it")]
    const __version__: &str = env!("CARGO_PKG_VERSION");
}

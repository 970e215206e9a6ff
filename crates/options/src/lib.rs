//! Command-line options of a scenario and a run of it, shared by the programs and their subcommands, and the file by which
//! a supervisor hands them on to its arena.

#![forbid(unsafe_code)]

mod assignment;
mod run_options;

pub use assignment::{Assignment, Work};
pub use run_options::{
    LoadError, ModeName, OverloadName, PlayOptions, RunOptions, ScenarioOptions, toml_number,
};

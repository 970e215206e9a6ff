//! A scenario file as it is written: its tables, one module each, and the defaults of keys that are left out.
//!
//! In:  the TOML tree of a file. The doc comments here are the schema's descriptions.
//! Out: tables as they are resolved, or the first [`Problem`](crate::Problem) of one. A table whose keys all stand for
//!      themselves is the same type in both; one with keys that depend on others (`…Keys`) resolves to another.

pub(crate) mod arena;
pub(crate) mod channel;
mod choice;
pub(crate) mod controller;
pub(crate) mod convergence;
pub(crate) mod field;
pub(crate) mod fuzz;
pub(crate) mod light;
pub(crate) mod output;
pub(crate) mod processes;
pub(crate) mod robots;
pub(crate) mod sensors;
pub(crate) mod whole;

pub use arena::ArenaSpec;
pub use channel::{AccessKey, ChannelKeys, ModelKey};
pub use convergence::ConvergenceSpec;
pub use field::{FieldSpec, GaussianSpec, LampSpec};
pub use fuzz::FuzzSpec;
pub use output::OutputSpec;
pub use processes::{OnHang, ProcessesSpec};

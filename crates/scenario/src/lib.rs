//! The scenario: the TOML file that defines a run, resolved, checked and explained.
//!
//! In:  the text of a file and overrides from the command line (`--set key.path=value`).
//! Out: a [`Scenario`] that every later stage can trust, or one clear line that says where and what is wrong.
//!
//! A file becomes a `document` (a TOML tree that knows where each value was written), overrides change the tree, the
//! tree becomes the tables of [`mod@file`], whose keys may be left out, each table is resolved to what its keys and their
//! defaults mean, and `check` asks what no single table can answer. Defaults are written in [`mod@file`] and nowhere else.
//! Reading the file in `load` is the only I/O of this crate.
//!
//! ```
//! use scenario::Scenario;
//!
//! let text = "duration_s = 1\nstep_s = 0.1\narena.size_m = [2, 1]\nrobots.count = 3\nchannel.range_m = 1\n\
//!             controller.gain_per_s = 1";
//! let scenario = Scenario::parse("three.toml", text, &["robots.count=4".parse()?])?;
//! assert_eq!((scenario.robot_count(), scenario.ticks()), (4, 10));
//!
//! let error = Scenario::parse("three.toml", &text.replace("gain", "gian"), &[]).unwrap_err();
//! assert!(error.to_string().starts_with("three.toml:6: "), "{error}");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#[macro_use]
mod number;
mod act;
mod channel;
mod check;
mod controller;
mod document;
mod error;
mod explain;
pub mod fault;
mod field_change;
pub mod file;
mod hex;
mod light;
mod load;
mod overrides;
mod problem;
mod process_fault;
mod recorded;
mod resolve;
mod robot_set;
mod robots;
mod scenario;
mod schema;
mod sensors;
mod steps;
mod tables;
mod time_out;

pub use act::ActError;
pub use channel::{Access, Air, Capture, ChannelModel, ChannelSpec, Medium, Profile};
pub use check::MAX_GAIN_STEP;
pub use controller::{Controller, Gradient, LawSpec, Mind, ProgramSpec, PythonSpec, Speaks};
pub use error::{Origin, Place, ScenarioError};
pub use fault::{Fault, FaultKind};
pub use file::{
    ArenaSpec, ConvergenceSpec, FieldSpec, FuzzSpec, GaussianSpec, LampSpec, OnHang, OutputSpec,
    ProcessesSpec,
};
pub use hex::{PayloadHex, PayloadHexError};
pub use light::{LightSpec, RingSpec};
pub use load::BYTES_MAX;
pub use number::{
    DiodeCount, FaultCount, Finite, FlipCount, MAX_ROBOTS, NonNegative, PayloadBytes, Positive, Probability,
    Refused, RobotCount, SEED_MAX, Seed, Share, Xy,
};
pub use overrides::{Override, OverrideError};
pub use problem::Problem;
pub use process_fault::{ProcessAction, ProcessFault};
pub use robot_set::{Link, LinkError, RobotSet, RobotSetError};
pub use robots::{Drive, RobotsSpec};
pub use scenario::Scenario;
pub use schema::schema_json;
pub use sensors::{OdometrySpec, Sensor, SensorsSpec};
pub use steps::{Rounded, Roundings, STEPS_MAX};

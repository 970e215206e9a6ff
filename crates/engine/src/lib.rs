//! The loop of a run: tick the arena, ask the squad, tell the observers.
//!
//! [`play`] is the loop that every run shares. It knows neither processes nor files nor a terminal: robots are a
//! [`Squad`](squad::Squad), wherever they are, and whoever wants to see, keep or judge what happens is an [`Observer`].
//! [`run`] plays a scenario in this process, with controllers of your own:
//!
//! ```
//! use std::convert::Infallible;
//!
//! use protocol::{
//!     command::Command,
//!     controller::{Controller, StageObserver},
//!     percept::Percept,
//! };
//! use scenario::Scenario;
//!
//! /// Stands still and is heard.
//! struct Beacon;
//!
//! impl Controller for Beacon {
//!     fn boot(&mut self) -> Command {
//!         Command::REST
//!     }
//!
//!     fn step(&mut self, _: &Percept, _: &mut dyn StageObserver) -> Command {
//!         Command::REST
//!     }
//! }
//!
//! let text = "duration_s = 1\nstep_s = 0.1\narena.size_m = [2, 1]\nrobots.count = 3\nchannel.range_m = 1\n\
//!             [[controller]]\nprogram = [\"beacon\"]";
//! let scenario = Scenario::parse("beacons", text, &[])?;
//! let beacon = engine::controller(|_, _| Ok::<_, Infallible>(Beacon));
//! let summary = engine::run(&scenario, &[&beacon], &mut [])?;
//! assert_eq!((summary.ticks, summary.end.robots_alive), (10, 3));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![forbid(unsafe_code)]

pub mod act;
mod cores;
mod in_process;
mod observer;
pub mod pace;
mod play;
pub mod properties;
mod run;
pub mod summary;

pub use in_process::InProcess;
pub use observer::{Acted, Observer, ObserverError, RunInfo, TickStamps, TickView};
pub use play::{Plan, play, play_under};
pub use run::{NewController, RunError, controller, run};
/// Words of a squad that observers are told in.
pub use squad::{Awaited, Incident, Participation, RobotStatus, Waited, Waiting, stop::StopFlag};

//! The loop of a run: tick the arena, ask the squad, tell the observers.
//!
//! [`play`] is the loop that every run shares. It knows neither processes nor files nor a terminal: robots are a
//! [`Squad`](squad::Squad), wherever they are, and whoever wants to see, keep or judge what happens is an [`Observer`].
//! [`run`] plays a scenario in this process, with controllers of your own:
//!
//! ```
//! use engine::InProcess;
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
//! let text = "duration_s = 1\nstep_s = 0.1\narena.size_m = [2, 1]\nrobots.count = 3\n\
//!             controller.gain_per_s = 1\nchannel.range_m = 1";
//! let scenario = Scenario::parse("beacons", text, &[])?;
//! let mut squad = InProcess::new(0..scenario.robot_count(), 4, |_| Beacon);
//! let summary = engine::run(&scenario, &mut squad, &mut [])?;
//! assert_eq!(summary.ticks, 10);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![forbid(unsafe_code)]

mod cores;
mod in_process;
mod observer;
pub mod pace;
mod play;
pub mod summary;

pub use in_process::InProcess;
pub use observer::{Observer, ObserverError, RunInfo, TickStamps, TickView};
pub use play::{Plan, play, run};
/// Words of a squad that observers are told in.
pub use squad::{Awaited, Incident, Participation, RobotStatus, Waited, Waiting, stop::StopFlag};

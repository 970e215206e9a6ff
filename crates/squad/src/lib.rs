//! The robots of a run behind one small interface: percepts go in, commands come out.
//!
//! [`Squad`] is all that the loop of a run knows of its robots, wherever they are: processes of this machine,
//! controllers in the same process, robots on another host, or a [`Composite`] of these.

#![forbid(unsafe_code)]

mod composite;
pub mod cores;
pub mod moment;
mod squad;
mod status;
pub mod stop;
mod waiting;

pub use composite::Composite;

/// Lives of a robot in a row that may fail to begin, under `on_hang = "restart"`: what cannot run is not started for
/// ever.
pub const STILLBORN_MAX: u32 = 5;

pub use squad::{Answers, Incident, Squad, SquadError, WaitingSink};
pub use status::{Participation, RobotStatus};
pub use waiting::{Awaited, NAMED_MAX, Waited, Waiting};

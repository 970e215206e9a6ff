//! Measurements of agents as plain data: their cycles, stage by stage, histograms, and totals.
//!
//! They pass from whoever measures to whoever shows them: neither knows the other. Nothing of it reaches arena or
//! agents: a run goes the same way whether it is measured or not.

#![forbid(unsafe_code)]

mod cycle_times;
mod histograms;
mod profile;
mod recent;
mod totals;
mod usage;
mod window;

use std::sync::{Arc, OnceLock};

pub use cycle_times::{CycleTimes, PacketNumber, Stage};
pub use histograms::{Histograms, Span, Spread};
pub use profile::{ClockUsed, Profile, RobotProfile, Source};
pub use recent::{Recent, RecentCycles, RecentTimes, WatchedCycles};
pub use totals::{Processes, StagesUs, Totals};
pub use usage::{Counted, Usage};
pub use window::{Quantiles, Window};

/// Place where who measures leaves the profile of a run at its end, for those who show it.
pub type ProfileSlot = Arc<OnceLock<Profile>>;

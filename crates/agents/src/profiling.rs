//! Profile of the agents: each stage of their cycles, their packets' way through the transport, and what the
//! operating system counts of their processes.
//!
//! In:  stamps in the agents' commands ([`transport::raw::RawTimes`]), the arena's own, and `/proc`.
//! Out: a [`Profile`](profile::Profile), with histograms per robot.

mod counters;
mod flight;
mod journal;
mod measure;
mod recorder;
mod tally;
mod usage;

pub use measure::Measure;
pub(crate) use recorder::Recorder;

//! The squad of local processes: joining, lock-step, real time, hang policy, profile.
//!
//! [`Lockstep`] and [`Realtime`] are [`squad::Squad`]s. They know robots' ids, process faults and durations, and no
//! arena: another host can run its share of a swarm by the same code.

#![forbid(unsafe_code)]

mod by_hand;
mod lockstep;
mod member;
mod profiling;
mod realtime;
mod remains;
mod roster;
mod second_core;
mod supervisor_link;
mod waiting;

pub use lockstep::Lockstep;
pub use profiling::Measure;
pub use realtime::Realtime;
pub use roster::HostConfig;
pub use supervisor_link::{Link, Lost, Trials, tell};

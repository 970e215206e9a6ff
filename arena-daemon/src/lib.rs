//! I/O around [`arena`]: the loop that every engine shares, and the squads of robots it runs.
//!
//! [`engine::run`] is the loop. It asks a [`squad::Squad`] for commands and knows nothing of
//! where they come from: processes in lock-step, processes on their own timers, or (in the
//! `lamplight` command) controllers in the same process.

#![forbid(unsafe_code)]

pub mod cores;
pub mod engine;
pub mod live;
pub mod options;
pub mod outputs;
pub mod pace;
pub mod process;
pub mod profile;
pub mod progress;
pub mod squad;
pub mod standstill;
pub mod stop;
pub mod summary;
pub mod supervisor_link;
pub mod trace;
pub mod trial;

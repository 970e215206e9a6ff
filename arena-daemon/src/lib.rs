//! Options of a run, and one trial of a batch: what the program `arena-daemon` shares with the command `lamplight`.

#![forbid(unsafe_code)]

pub mod options;
pub mod trial;

//! Shared parts of the cross-crate tests: reference vectors, the real programs, and a reader of traces.

#![forbid(unsafe_code)]

pub mod live;
pub mod programs;
pub mod trace;
pub mod vectors;

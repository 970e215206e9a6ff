//! What the cross-crate tests share: reference vectors, the real programs, and a reader of traces.

#![forbid(unsafe_code)]

pub mod live;
pub mod programs;
pub mod trace;
pub mod vectors;

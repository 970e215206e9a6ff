//! What the cross-crate tests share: reference vectors, and the real programs.

#![forbid(unsafe_code)]

pub mod live;
pub mod programs;
pub mod vectors;

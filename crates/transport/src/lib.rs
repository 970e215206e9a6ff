//! Transport of percepts and commands between processes.
//!
//! Raw messages in shared memory, the two planes of iceoryx2 and the doorbell; the folder of a run, its locks and
//! control blobs; the clock that stamps what agents do. What the messages mean is in [`protocol`].

#![deny(unsafe_code)]

pub mod clock;
pub mod conformance;
pub mod control;
pub mod doorbell;
pub mod ends;
pub mod footprint;
pub mod frame_cache;
pub mod mapping;
pub mod owner;
pub mod pid_namespace;
pub mod raw;
pub mod run_dir;
pub mod services;
pub mod shared_memory;
mod version;

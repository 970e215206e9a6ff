//! What crosses a process boundary in a Lamplight run.
//!
//! The first half is `no_std` and knows no operating system: units, the body frame, robot ids and their
//! clocks, infrared packets, percepts and commands. The second half, behind the feature `ipc`, carries
//! them between processes: raw shared-memory messages, iceoryx2 services, the doorbell, the run's
//! directory and the codec of control blobs.

#![no_std]
#![deny(unsafe_code)]

#[cfg(any(feature = "ipc", feature = "std", test))]
extern crate std;

pub mod command;
pub mod frame;
pub mod odometry;
#[cfg(feature = "oscillator")]
pub mod oscillator;
pub mod packet;
pub mod percept;
pub mod robot_id;
pub mod setup;
pub mod units;

#[cfg(feature = "ipc")]
pub mod codec;
#[cfg(feature = "ipc")]
pub mod control;
#[cfg(feature = "ipc")]
pub mod cycles;
#[cfg(feature = "ipc")]
pub mod doorbell;
#[cfg(feature = "ipc")]
pub mod footprint;
#[cfg(feature = "ipc")]
pub mod frame_cache;
#[cfg(feature = "ipc")]
pub mod mapping;
#[cfg(feature = "ipc")]
pub mod owner;
#[cfg(feature = "ipc")]
pub mod pid_namespace;
#[cfg(feature = "ipc")]
pub mod raw;
#[cfg(feature = "ipc")]
pub mod run_dir;
#[cfg(feature = "ipc")]
pub mod services;
#[cfg(feature = "ipc")]
pub mod shared_memory;

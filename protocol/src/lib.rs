//! The vocabulary of a Lamplight run: what robots and arena tell each other.
//!
//! Units, the body frame, robot ids and their clocks, infrared packets, percepts and commands. It knows no operating
//! system; the crate `transport` carries these values between processes.

#![no_std]
#![forbid(unsafe_code)]

extern crate alloc;
#[cfg(any(feature = "std", test))]
extern crate std;

#[cfg(feature = "std")]
pub mod codec;
pub mod command;
pub mod controller;
mod delivery;
pub mod frame;
#[cfg(feature = "std")]
pub mod giving_up;
pub mod granted;
pub mod notes;
pub mod odometry;
#[cfg(feature = "oscillator")]
pub mod oscillator;
pub mod packet;
#[cfg(feature = "std")]
pub mod params;
pub mod payload;
pub mod percept;
#[cfg(feature = "std")]
pub mod property;
pub mod robot_id;
pub mod setup;
pub mod units;

//! A run while it goes on, for those who want to see: over HTTP for Prometheus, and over a socket in the run's folder
//! for `lamplight top`.
//!
//! The [`SnapshotPublisher`] writes a [`Snapshot`] ten times a second at most, and at once who is waited for;
//! threads of their own hand it out. Each tick is timed, and each cycle noted, only while somebody watches. Nothing of
//! it reaches arena or agents: a run goes the same way whether it is watched or not.

pub mod acts;
mod address;
pub mod http;
pub mod prometheus;
mod publisher;
mod server;
mod snapshot;
pub mod socket;
mod state;
pub mod stream;

pub use address::ListenAddr;
pub use publisher::SnapshotPublisher;
pub use server::CLIENTS_MAX;
pub use snapshot::{About, Dropped, Phase, Robot, Snapshot};
pub use state::Live;

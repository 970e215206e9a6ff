//! Recordings of runs: MCAP files that the tools of robotics open, and that prove what happened.
//!
//! In:  messages in order of time ([`Writer`]).
//! Out: the same messages ([`Reader`]), of a file that was cut anywhere those before the cut.
//!
//! Messages are protobuf: Foxglove's where those exist, ours elsewhere (`proto/`). Chunks are compressed; what has been
//! [flushed](Writer::flush) survives whatever ends the process.

#![forbid(unsafe_code)]

mod columns;
mod messages;
mod reader;
mod stream;
mod topic;
mod writer;

pub use prost::Message;

pub use crate::{
    columns::Malformed,
    messages::{foxglove, lamplight, timestamp},
    reader::{Entry, ReadError, Reader},
    stream::{StreamReader, StreamWriter},
    topic::Topic,
    writer::{WriteError, Writer},
};

/// Version of the messages in `proto/lamplight.proto`.
pub const FORMAT: u32 = 2;

//! Recordings of runs: MCAP files that the tools of robotics open, and that prove what happened.
//!
//! In:  messages in order of time ([`Writer`]).
//! Out: the same messages ([`Reader`]), of a file that was cut anywhere those before the cut.
//!
//! Messages are protobuf: Foxglove's where those exist, ours elsewhere (`proto/`). Chunks are compressed; what has been
//! [flushed](Writer::flush) survives whatever ends the process.

#![forbid(unsafe_code)]

mod columns;
mod reader;
mod stream;
mod topic;
mod writer;

pub use prost::Message;

pub use crate::{
    columns::Malformed,
    reader::{Entry, ReadError, Reader},
    stream::{StreamReader, StreamWriter},
    topic::Topic,
    writer::{WriteError, Writer},
};

/// Version of the messages in `proto/lamplight.proto`.
pub const FORMAT: u32 = 2;

/// Messages that viewers draw, by Foxglove.
#[allow(missing_docs, reason = "they are documented where they are from")]
pub mod foxglove {
    include!(concat!(env!("OUT_DIR"), "/foxglove.rs"));
}

/// Messages of our own.
#[allow(missing_docs, reason = "`proto/lamplight.proto` documents them")]
pub mod lamplight {
    include!(concat!(env!("OUT_DIR"), "/lamplight.rs"));
}

/// Nanoseconds of virtual time as protobuf has them.
pub fn timestamp(time_ns: u64) -> prost_types::Timestamp {
    const NS_PER_S: u64 = 1_000_000_000;
    prost_types::Timestamp { seconds: (time_ns / NS_PER_S) as i64, nanos: (time_ns % NS_PER_S) as i32 }
}

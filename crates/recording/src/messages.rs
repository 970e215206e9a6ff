//! Messages of recordings, as types.

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

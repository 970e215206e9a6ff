//! Writes a recording.

use std::{
    collections::BTreeMap,
    io::{self, Seek, Write},
};

use mcap::{McapError, WriteOptions, records::MessageHeader};
use prost::Message;

use crate::topic::Topic;

/// Descriptions of messages, for readers: Foxglove's, and ours.
const FOXGLOVE: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/foxglove.bin"));
const LAMPLIGHT: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/lamplight.bin"));

/// Bytes of messages in a chunk: as much is lost at most where the disk is full.
const CHUNK_BYTES: u64 = 256 << 10;

/// Why a recording cannot be written on.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct WriteError(McapError);

impl From<WriteError> for io::Error {
    fn from(WriteError(error): WriteError) -> Self {
        match error {
            McapError::Io(error) => error,
            error => Self::other(error),
        }
    }
}

/// A recording that grows.
pub struct Writer<W: Write + Seek> {
    file: mcap::Writer<W>,
    channels: BTreeMap<Topic, u16>,
    message: Vec<u8>,
    written: u32,
}

impl<W: Write + Seek> Writer<W> {
    /// Begins a recording.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn new(file: W) -> Result<Self, WriteError> {
        let options = WriteOptions::new()
            .chunk_size(Some(CHUNK_BYTES))
            .library(concat!("lamplight ", env!("CARGO_PKG_VERSION")));
        let mut file = options.create(file).map_err(WriteError)?;
        let mut channels = BTreeMap::new();
        for topic in Topic::ALL {
            let descriptors = if topic.schema().starts_with("lamplight.") { LAMPLIGHT } else { FOXGLOVE };
            let schema = file.add_schema(topic.schema(), "protobuf", descriptors).map_err(WriteError)?;
            let channel = file.add_channel(schema, topic.name(), "protobuf", &BTreeMap::new());
            channels.insert(topic, channel.map_err(WriteError)?);
        }
        Ok(Self { file, channels, message: Vec::new(), written: 0 })
    }

    /// Adds a message, at so many nanoseconds of virtual time: no earlier than the one before it.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn write(&mut self, topic: Topic, time_ns: u64, message: &impl Message) -> Result<(), WriteError> {
        self.message.clear();
        message.encode(&mut self.message).expect("a vector takes all that is written to it");
        let header = MessageHeader {
            channel_id: self.channels[&topic],
            sequence: self.written,
            log_time: time_ns,
            publish_time: time_ns,
        };
        self.written = self.written.wrapping_add(1);
        self.file.write_to_known_channel(&header, &self.message).map_err(WriteError)
    }

    /// Writes all that was added so that it can be read whatever happens from here on.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn flush(&mut self) -> Result<(), WriteError> {
        self.file.flush().map_err(WriteError)
    }

    /// Ends the recording, with indexes for those who seek.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn finish(mut self) -> Result<(), WriteError> {
        self.file.finish().map(drop).map_err(WriteError)
    }
}

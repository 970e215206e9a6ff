//! Writes the storage file of a bag: MCAP as rosbag2 has it.
//!
//! Source: <https://mcap.dev/spec/registry>, profile `ros2`, and `rosbag2_storage_mcap` of ROS 2 Jazzy.

use std::{
    collections::BTreeMap,
    io::{self, Seek, Write},
};

use mcap::{
    McapError, WriteOptions,
    records::{MessageHeader, Metadata},
};

use crate::{
    cdr,
    definitions::MessageType,
    messages::Message,
    metadata::{self, Contents, OFFERED_QOS_PROFILES},
    topic::{TOPICS, Topic},
};

/// Why a bag cannot be written on.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// The storage file cannot be written.
    #[error(transparent)]
    Storage(#[from] McapError),
    /// A message cannot be put into CDR.
    #[error("a message on {0} cannot be encoded: {1}")]
    Message(&'static str, cdr_encoding::Error),
    /// The metadata cannot be put into YAML.
    #[error("its metadata cannot be encoded: {0}")]
    Metadata(#[from] serde_saphyr::SerializeError),
}

impl From<WriteError> for io::Error {
    fn from(error: WriteError) -> Self {
        match error {
            WriteError::Storage(McapError::Io(error)) => error,
            error => Self::other(error),
        }
    }
}

/// A bag whose storage file is written, without the folder around it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Bag {
    /// The text of its `metadata.yaml`.
    pub metadata: String,
    /// Number of its messages.
    pub messages: u64,
    /// Time from its first message to its last, nanoseconds.
    pub duration_ns: u64,
}

/// A storage file that grows.
pub(crate) struct Writer<W: Write + Seek> {
    file: mcap::Writer<W>,
    file_name: String,
    /// Number of messages of each topic, with its number in the file.
    topics: BTreeMap<Topic, (u16, u64)>,
    /// Earliest and latest time of a message, nanoseconds.
    times_ns: Option<[u64; 2]>,
    message: Vec<u8>,
}

impl<W: Write + Seek> Writer<W> {
    /// Begins a storage file, whose name the metadata will tell.
    pub(crate) fn new(file: W, file_name: String) -> Result<Self, WriteError> {
        let options =
            WriteOptions::new().profile("ros2").library(concat!("lamplight ", env!("CARGO_PKG_VERSION")));
        let mut file = options.create(file)?;
        let mut schemas = BTreeMap::new();
        for message in MessageType::ALL {
            let schema = file.add_schema(message.name(), "ros2msg", message.definition().as_bytes())?;
            schemas.insert(message, schema);
        }
        let mut topics = BTreeMap::new();
        for topic in TOPICS {
            let metadata =
                [("offered_qos_profiles", OFFERED_QOS_PROFILES), ("topic_type_hash", topic.message.hash())];
            let metadata = metadata.map(|(key, value)| (key.to_owned(), value.to_owned())).into();
            let channel = file.add_channel(schemas[&topic.message], topic.name, "cdr", &metadata)?;
            topics.insert(topic, (channel, 0));
        }
        Ok(Self { file, file_name, topics, times_ns: None, message: Vec::new() })
    }

    /// Adds a message of a topic, at so many nanoseconds of virtual time.
    pub(crate) fn write<M: Message>(
        &mut self,
        topic: Topic,
        time_ns: u64,
        message: &M,
    ) -> Result<(), WriteError> {
        debug_assert_eq!(topic.message, M::TYPE);
        let (channel_id, count) = self.topics.get_mut(&topic).expect("all topics are in the file");
        let failed = |error| WriteError::Message(topic.name, error);
        cdr::encode(message, &mut self.message).map_err(failed)?;
        // As rosbag2 writes it: messages have no number.
        let header =
            MessageHeader { channel_id: *channel_id, sequence: 0, log_time: time_ns, publish_time: time_ns };
        self.file.write_to_known_channel(&header, &self.message)?;
        *count += 1;
        let [first_ns, last_ns] = self.times_ns.unwrap_or([time_ns; 2]);
        self.times_ns = Some([first_ns.min(time_ns), last_ns.max(time_ns)]);
        Ok(())
    }

    /// Ends the file, with indexes and the bag's metadata.
    pub(crate) fn finish(mut self) -> Result<Bag, WriteError> {
        let times_ns = self.times_ns.unwrap_or_default();
        let messages: Vec<_> = TOPICS.iter().map(|topic| (*topic, self.topics[topic].1)).collect();
        let count = messages.iter().map(|(_, count)| count).sum();
        let metadata = metadata::metadata(&self.file_name, &Contents { times_ns, messages })?;
        // The same again in the file, where rosbag2 looks if the folder is lost.
        let metadata_in_file = [("serialized_metadata".to_owned(), metadata.clone())].into();
        self.file.write_metadata(&Metadata { name: "rosbag2".into(), metadata: metadata_in_file })?;
        self.file.finish()?;
        Ok(Bag { metadata, messages: count, duration_ns: times_ns[1] - times_ns[0] })
    }
}

//! `metadata.yaml`: what a bag holds, as rosbag2 writes it down.
//!
//! Source: `rosbag2_storage` of rosbag2 0.15 (Humble), which reads qualities of service as text, and 0.26 (Jazzy): `yaml.hpp`, `qos.cpp`.

use serde::Serialize;

use crate::topic::Topic;

/// Version of the format: the last whose qualities of service are text, which Humble asks for. Later distributions read both.
const VERSION: u32 = 8;

/// The quality of service that all topics were offered with, in numbers of `rmw`: the last 10 messages, all of them delivered,
/// none to those who come late; deadlines, lifespans and leases without an end.
pub(crate) const OFFERED_QOS_PROFILES: &str = "\
- history: 1
  depth: 10
  reliability: 1
  durability: 2
  deadline:
    sec: 9223372036
    nsec: 854775807
  lifespan:
    sec: 9223372036
    nsec: 854775807
  liveliness: 1
  liveliness_lease_duration:
    sec: 9223372036
    nsec: 854775807
  avoid_ros_namespace_conventions: false";

/// Messages in a storage file, in numbers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Contents {
    /// Earliest and latest time of a message, nanoseconds; 0 and 0 if there is none.
    pub(crate) times_ns: [u64; 2],
    /// Number of messages of each topic.
    pub(crate) messages: Vec<(Topic, u64)>,
}

/// Returns the text of `metadata.yaml` of a bag whose storage file has this name and these contents.
///
/// # Errors
/// If it cannot be put into YAML.
pub(crate) fn metadata(
    storage_file: &str,
    contents: &Contents,
) -> Result<String, serde_saphyr::SerializeError> {
    let [first_ns, last_ns] = contents.times_ns;
    let starting_time = StartingTime { nanoseconds_since_epoch: first_ns };
    let duration = Duration { nanoseconds: last_ns - first_ns };
    let message_count = contents.messages.iter().map(|(_, count)| count).sum();
    let topic = |&(Topic { name, message }, message_count): &(Topic, u64)| TopicWithMessageCount {
        topic_metadata: TopicMetadata {
            name,
            r#type: message.name(),
            serialization_format: "cdr",
            offered_qos_profiles: OFFERED_QOS_PROFILES,
            type_description_hash: message.hash(),
        },
        message_count,
    };
    let file = FileInformation { path: storage_file, starting_time, duration, message_count };
    serde_saphyr::to_string(&Metadata {
        rosbag2_bagfile_information: BagMetadata {
            version: VERSION,
            storage_identifier: "mcap",
            duration,
            starting_time,
            message_count,
            topics_with_message_count: contents.messages.iter().map(topic).collect(),
            compression_format: "",
            compression_mode: "",
            relative_file_paths: [storage_file],
            files: [file],
            custom_data: CustomData { lamplight: env!("CARGO_PKG_VERSION") },
            ros_distro: "",
        },
    })
}

#[derive(Serialize)]
struct Metadata<'a> {
    rosbag2_bagfile_information: BagMetadata<'a>,
}

#[derive(Serialize)]
struct BagMetadata<'a> {
    version: u32,
    storage_identifier: &'a str,
    duration: Duration,
    starting_time: StartingTime,
    message_count: u64,
    topics_with_message_count: Vec<TopicWithMessageCount<'a>>,
    compression_format: &'a str,
    compression_mode: &'a str,
    relative_file_paths: [&'a str; 1],
    files: [FileInformation<'a>; 1],
    custom_data: CustomData<'a>,
    ros_distro: &'a str,
}

#[derive(Clone, Copy, Serialize)]
struct Duration {
    nanoseconds: u64,
}

#[derive(Clone, Copy, Serialize)]
struct StartingTime {
    nanoseconds_since_epoch: u64,
}

#[derive(Serialize)]
struct TopicWithMessageCount<'a> {
    topic_metadata: TopicMetadata<'a>,
    message_count: u64,
}

#[derive(Serialize)]
struct TopicMetadata<'a> {
    name: &'a str,
    r#type: &'a str,
    serialization_format: &'a str,
    offered_qos_profiles: &'a str,
    type_description_hash: &'a str,
}

#[derive(Serialize)]
struct FileInformation<'a> {
    path: &'a str,
    starting_time: StartingTime,
    duration: Duration,
    message_count: u64,
}

/// Free to use by the format.
#[derive(Serialize)]
struct CustomData<'a> {
    /// Version of the program that wrote it.
    lamplight: &'a str,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::topic;

    #[test]
    fn the_keys_are_those_of_rosbag2_and_what_it_takes_for_text_is_text() {
        let contents = Contents { times_ns: [100, 350], messages: vec![(topic::CLOCK, 2)] };
        let profiles = OFFERED_QOS_PROFILES.replace('\n', "\n        ");
        // A file's name that YAML would read as a number.
        let expected = format!(
            r#"rosbag2_bagfile_information:
  version: 8
  storage_identifier: mcap
  duration:
    nanoseconds: 250
  starting_time:
    nanoseconds_since_epoch: 100
  message_count: 2
  topics_with_message_count:
  - topic_metadata:
      name: /clock
      type: rosgraph_msgs/msg/Clock
      serialization_format: cdr
      offered_qos_profiles: |-
        {profiles}
      type_description_hash: RIHS01_692f7a66e93a3c83e71765d033b60349ba68023a8c689a79e48078bcb5c58564
    message_count: 2
  compression_format: ""
  compression_mode: ""
  relative_file_paths:
  - "12"
  files:
  - path: "12"
    starting_time:
      nanoseconds_since_epoch: 100
    duration:
      nanoseconds: 250
    message_count: 2
  custom_data:
    lamplight: "0.1.0"
  ros_distro: ""
"#
        );
        assert_eq!(metadata("12", &contents).unwrap(), expected);
    }
}

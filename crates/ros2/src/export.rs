//! A recording, message by message, as a bag.

use std::io::{Seek, Write};

use recording::{
    Entry, ReadError, Topic,
    foxglove::{PosesInFrame, SceneUpdate},
    lamplight::Metrics,
};

use crate::{
    messages::{Clock, Float64, Header, Time},
    metrics, poses,
    scene::Scene,
    topic,
    writer::{Bag, WriteError, Writer},
};

/// The frame that all poses and shapes are in: the recording's frames `world` and `arena`, which are the same place.
const WORLD: &str = "world";

/// Why a recording cannot be exported.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// A message of the recording is not understood.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The bag cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
}

/// A bag that grows with each message of a recording.
pub struct Export<W: Write + Seek> {
    bag: Writer<W>,
    scene: Scene,
    /// The time that the last message on `/clock` told, nanoseconds.
    clock_ns: Option<u64>,
    robots: usize,
}

impl<W: Write + Seek> Export<W> {
    /// Begins a bag in `file`, its storage file, which will have the name `file_name` in the bag's folder.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn begin(file: W, file_name: String) -> Result<Self, WriteError> {
        let bag = Writer::new(file, file_name)?;
        Ok(Self { bag, scene: Scene::default(), clock_ns: None, robots: 0 })
    }

    /// Adds what a message of the recording says, if ROS 2 has messages for it.
    ///
    /// # Errors
    /// If the message does not decode, or the bag cannot be written.
    pub fn add(&mut self, entry: &Entry) -> Result<(), ExportError> {
        let time_ns = entry.time_ns;
        match entry.topic {
            Topic::Robots => {
                let recorded: PosesInFrame = entry.message()?;
                self.robots = recorded.poses.len();
                let (transforms, poses) = poses::robots(&recorded.poses, &header(time_ns));
                self.tell_time(time_ns)?;
                self.bag.write(topic::TRANSFORMS, time_ns, &transforms)?;
                self.bag.write(topic::POSES, time_ns, &poses)?;
            }
            Topic::Scene => {
                let update: SceneUpdate = entry.message()?;
                let markers = self.scene.updated(update, &header(time_ns));
                self.tell_time(time_ns)?;
                self.bag.write(topic::SCENE, time_ns, &markers)?;
            }
            Topic::Metrics => {
                let recorded: Metrics = entry.message()?;
                self.tell_time(time_ns)?;
                for (topic, data) in metrics::known(&recorded) {
                    self.bag.write(topic, time_ns, &Float64 { data })?;
                }
            }
            _ => {}
        }
        Ok(())
    }

    /// Tells the time before the first message of each moment.
    fn tell_time(&mut self, time_ns: u64) -> Result<(), WriteError> {
        if self.clock_ns.is_some_and(|told_ns| told_ns >= time_ns) {
            return Ok(());
        }
        self.clock_ns = Some(time_ns);
        self.bag.write(topic::CLOCK, time_ns, &Clock { clock: Time::of(time_ns) })
    }

    /// Number of robots in the latest poses.
    pub fn robots(&self) -> usize {
        self.robots
    }

    /// Ends the storage file.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn finish(self) -> Result<Bag, WriteError> {
        self.bag.finish()
    }
}

fn header(time_ns: u64) -> Header {
    Header { stamp: Time::of(time_ns), frame_id: WORLD.into() }
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use mcap::MessageStream;
    use recording::{Reader, foxglove::Pose, lamplight::Tick};

    use super::*;

    #[test]
    fn a_bag_has_the_time_of_each_moment_first_and_says_of_itself_what_it_is() {
        let mut recorded = Cursor::new(Vec::new());
        let mut writer = recording::Writer::new(&mut recorded).unwrap();
        let poses = PosesInFrame { poses: vec![Pose::default(); 3], ..PosesInFrame::default() };
        for time_ns in [0, 500_000_000] {
            writer.write(Topic::Scene, time_ns, &SceneUpdate::default()).unwrap();
            writer.write(Topic::Robots, time_ns, &poses).unwrap();
            writer.write(Topic::Ticks, time_ns, &Tick::default()).unwrap();
        }
        let metrics = Metrics { cost_h: Some(2.0), ..Metrics::default() };
        writer.write(Topic::Metrics, 500_000_000, &metrics).unwrap();
        writer.finish().unwrap();

        let mut file = Cursor::new(Vec::new());
        let mut export = Export::begin(&mut file, "bag_0.mcap".into()).unwrap();
        let mut entries = Reader::new(recorded.get_ref().as_slice());
        while let Some(entry) = entries.next_entry().unwrap() {
            export.add(&entry).unwrap();
        }
        assert_eq!(export.robots(), 3);
        let bag = export.finish().unwrap();
        assert_eq!((bag.messages, bag.duration_ns), (15, 500_000_000));

        let bytes = file.into_inner();
        let messages: Vec<_> = MessageStream::new(&bytes).unwrap().map(Result::unwrap).collect();
        let told: Vec<_> =
            messages.iter().map(|it| (it.log_time / 1_000_000, it.channel.topic.as_str())).collect();
        let numbers = ["cost_h", "robots_alive", "robots_paused"].map(|name| format!("/metrics/{name}"));
        let [cost, alive, paused] = numbers.each_ref().map(|name| (500, name.as_str()));
        let moment = |ms| [(ms, "/clock"), (ms, "/scene"), (ms, "/tf"), (ms, "/robots")];
        assert_eq!(told[..11], [&moment(0)[..], &moment(500), &[cost, alive, paused]].concat());
        for message in &messages {
            let (channel, schema) = (&message.channel, message.channel.schema.as_ref().unwrap());
            assert_eq!((&*channel.message_encoding, &*schema.encoding), ("cdr", "ros2msg"));
            assert_eq!(channel.metadata["offered_qos_profiles"].lines().next(), Some("- history: 1"));
            assert_eq!(message.data[..4], [0, 1, 0, 0]);
        }
        assert_eq!(messages[8].data[4..], 2.0f64.to_le_bytes());
        let metadata = mcap::Summary::read(&bytes).unwrap().unwrap().metadata_indexes;
        assert_eq!(metadata[0].name, "rosbag2");
        assert!(bytes.windows(bag.metadata.len()).any(|part| part == bag.metadata.as_bytes()));
    }
}

//! `latency.hlog`: all histograms in the interval log that HdrHistogram's own analyzers read.
//!
//! One interval, the whole run, for each thing that is measured: first over all robots, tagged by its name (`cycle`),
//! then for each robot (`robot=17.span=cycle`). Values are nanoseconds.

use std::{io::Write, path::Path, time::Duration};

use anyhow::Context;
use files::{Lines, WriteError};
use hdrhistogram::serialization::{
    V2DeflateSerializer,
    interval_log::{IntervalLogWriterBuilder, Tag},
};

use profile::{Histograms, Profile, Span};

/// Column names by which analyzers tell what comes.
const LEGEND: &str =
    "\"StartTimestamp\",\"Interval_Length\",\"Interval_Max\",\"Interval_Compressed_Histogram\"";

/// Writes it to a new file at `path`.
///
/// # Errors
/// If the file cannot be written. What can be is there, by whole lines.
pub(super) fn write(profile: &Profile, path: &Path) -> Result<(), WriteError> {
    let mut log = Vec::new();
    write_to(profile, &mut log).expect("memory takes all that is written to it, and our tags are valid");
    Lines::create(path)?.add(&log)
}

fn write_to(profile: &Profile, file: &mut impl Write) -> anyhow::Result<()> {
    let mut serializer = V2DeflateSerializer::new();
    IntervalLogWriterBuilder::new()
        .add_comment("[Logged with lamplight; values are nanoseconds]")
        .add_comment("[Histogram log format version 1.3]")
        .with_start_time(profile.began)
        .with_base_time(profile.began)
        .begin_log_with(file, &mut serializer)?;
    // The legend is no comment, and the writer knows no other lines of ours: so a second one goes on.
    writeln!(file, "{LEGEND}")?;
    let mut log = IntervalLogWriterBuilder::new().begin_log_with(file, &mut serializer)?;
    let mut add = |histograms: &Histograms, span: Span, tag: &str| -> anyhow::Result<()> {
        let histogram = histograms.of(span);
        if !histogram.is_empty() {
            let tag = Tag::new(tag).context("tags are made of letters, digits, `=` and `.`")?;
            log.write_histogram(histogram, Duration::ZERO, profile.length, Some(tag))?;
        }
        Ok(())
    };
    let over_all = profile.over_all();
    for span in Span::ALL {
        add(&over_all, span, span.name())?;
    }
    for (index, robot) in profile.robots.iter().enumerate() {
        for span in Span::ALL {
            add(&robot.histograms, span, &format!("robot={index}.span={}", span.name()))?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::time::SystemTime;

    use base64::{Engine, engine::general_purpose::STANDARD};
    use hdrhistogram::{
        Histogram,
        serialization::{
            Deserializer,
            interval_log::{IntervalLogIterator, LogEntry},
        },
    };
    use profile::{ClockUsed, RobotProfile, Source, Stage};
    use protocol::setup::Mode;

    use super::*;

    fn robot(wake_ns: u64) -> RobotProfile {
        let mut histograms = Histograms::default();
        histograms.record(Span::Stage(Stage::Wake), wake_ns, 1);
        RobotProfile { histograms, cycles: 1, counts: 0, missed_deadlines: 0, usage: None, counted: None }
    }

    #[test]
    fn what_was_measured_is_read_back_and_what_was_not_is_left_out() {
        let profile = Profile {
            clock: ClockUsed { source: Source::Monotonic, mhz: 1000.0 },
            hardware_counters: "none".into(),
            mode: Mode::Lockstep,
            began: SystemTime::UNIX_EPOCH + Duration::from_millis(1_700_000_000_250),
            length: Duration::from_millis(1500),
            robots: vec![robot(5), robot(3_000_000_000)],
            cycles_left_out: 0,
            packets_unknown: 0,
        };
        let mut log = Vec::new();
        write_to(&profile, &mut log).unwrap();
        let (mut read, mut starts) = (Vec::new(), Vec::new());
        for entry in IntervalLogIterator::new(&log) {
            match entry.unwrap() {
                LogEntry::StartTime(time) | LogEntry::BaseTime(time) => starts.push(time),
                LogEntry::Interval(interval) => {
                    assert_eq!(interval.start_timestamp(), Duration::ZERO);
                    assert_eq!(interval.duration(), profile.length);
                    let bytes = STANDARD.decode(interval.encoded_histogram()).unwrap();
                    let histogram: Histogram<u32> =
                        Deserializer::new().deserialize(&mut bytes.as_slice()).unwrap();
                    read.push((interval.tag().unwrap().as_str().to_owned(), histogram));
                }
            }
        }
        assert_eq!(starts, [Duration::from_millis(1_700_000_000_250); 2]);
        let tags: Vec<_> = read.iter().map(|(tag, _)| tag.as_str()).collect();
        assert_eq!(tags, ["wake", "robot=0.span=wake", "robot=1.span=wake"]);
        let ranges: Vec<_> = read.iter().map(|(_, read)| (read.len(), read.min(), read.max())).collect();
        let longest = read[0].1.highest_equivalent(3_000_000_000);
        let lowest = read[0].1.lowest_equivalent(3_000_000_000);
        assert_eq!(ranges, [(2, 5, longest), (1, 5, 5), (1, lowest, longest)]);
    }
}

//! `latency.hlog`: all histograms in the interval log that HdrHistogram's own analyzers read.
//!
//! One interval, the whole run, for each thing that is measured: first over all robots, tagged by its name (`cycle`),
//! then for each robot (`robot=17.span=cycle`). Values are nanoseconds.

use std::{
    fs::File,
    io::{BufWriter, Write},
    path::Path,
    time::Duration,
};

use anyhow::Context;
use hdrhistogram::serialization::{
    V2DeflateSerializer,
    interval_log::{IntervalLogWriterBuilder, Tag},
};

use super::{
    Profile,
    histograms::{Histograms, Span},
};

/// Column names by which analyzers tell what comes.
const LEGEND: &str =
    "\"StartTimestamp\",\"Interval_Length\",\"Interval_Max\",\"Interval_Compressed_Histogram\"";

/// Writes it to a new file at `path`.
///
/// # Errors
/// If the file cannot be written.
pub(super) fn write(profile: &Profile, path: &Path) -> anyhow::Result<()> {
    let write = || -> anyhow::Result<()> {
        let mut file = BufWriter::new(File::create(path)?);
        let mut serializer = V2DeflateSerializer::new();
        IntervalLogWriterBuilder::new()
            .add_comment("[Logged with lamplight; values are nanoseconds]")
            .add_comment("[Histogram log format version 1.3]")
            .with_start_time(profile.began)
            .with_base_time(profile.began)
            .begin_log_with(&mut file, &mut serializer)?;
        // The legend is no comment, and the writer knows no other lines of ours: so a second one goes on.
        writeln!(file, "{LEGEND}")?;
        let mut log = IntervalLogWriterBuilder::new().begin_log_with(&mut file, &mut serializer)?;
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
        Ok(file.flush()?)
    };
    write().with_context(|| format!("cannot write {}", path.display()))
}

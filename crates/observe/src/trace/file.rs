//! The file of a trace: whole at any time, and never longer than it may be.
//!
//! ```text
//! {"traceEvents":[
//!   events ...
//! ],"displayTimeUnit":"ns","otherData":{ ... }}
//! ```
//!
//! What ends it is written with every piece, and written over by the next one. So a run that is killed leaves a trace
//! that can be read. On a disk that is full it is cut back to the last events that were added together and fit, so that
//! no arrow loses its head; what ends it finds room where the piece that did not fit was begun.

use std::{
    fs::{self, File},
    io, mem,
    os::unix::fs::FileExt,
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

use files::WriteError;
use protocol::percept::Tick;
use serde_json::{Map, Value};

use super::events::Cut;

/// Events are written once there are so many bytes of them, or after a second.
const PIECE: usize = 256 << 10;
const AT_LEAST_EVERY: Duration = Duration::from_secs(1);

/// A trace that grows.
#[derive(Debug)]
pub(super) struct TraceFile {
    path: PathBuf,
    file: File,
    /// Up to here it is written for good.
    length: u64,
    /// Text that follows it, and is not written yet.
    pending: Vec<u8>,
    /// Groups of events in it that belong together.
    groups: Vec<Group>,
    bytes_max: u64,
    written: Instant,
    /// Facts about the trace, written at its end.
    about: Map<String, Value>,
    /// End of the file as it is on disk.
    end_written: String,
}

/// Events that belong together: all of them are kept, or none.
#[derive(Clone, Copy, Debug)]
struct Group {
    /// Where they end in what is pending.
    end: usize,
    tick: Tick,
    is_cycle: bool,
}

/// Events that could not be written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Lost {
    /// The first tick of which something is missing; `None` if nothing is.
    pub(super) first_tick: Option<Tick>,
    /// Whole cycles of agents among them.
    pub(super) cycles: u64,
}

impl TraceFile {
    /// Begins a new file at `path` with `first`, the text of an event, and what is said `about` it at its end. It
    /// grows to `bytes_max` at most, if only `first` and `about` are shorter.
    ///
    /// # Errors
    /// If it is there already, or cannot be written. Then it is not in the way of the next attempt.
    pub(super) fn begin(
        path: &Path,
        bytes_max: u64,
        first: &str,
        about: Map<String, Value>,
    ) -> Result<Self, WriteError> {
        let mut file = Self {
            path: path.into(),
            file: File::create_new(path).map_err(|error| WriteError::new(path, error))?,
            length: 0,
            pending: format!("{{\"traceEvents\":[\n{first}").into_bytes(),
            groups: Vec::new(),
            bytes_max,
            written: Instant::now(),
            about,
            end_written: String::new(),
        };
        match file.write() {
            Ok(()) => Ok(file),
            Err((error, _)) => {
                let _ = fs::remove_file(path);
                Err(error)
            }
        }
    }

    /// Where it is.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// How long it is by now, bytes, but for its end.
    pub(super) fn length(&self) -> u64 {
        self.length + self.pending.len() as u64
    }

    /// How many more bytes of events fit in.
    pub(super) fn room(&self) -> u64 {
        self.bytes_max.saturating_sub(self.length() + self.end().len() as u64)
    }

    /// Changes what is said about the trace at its end. It takes from the room.
    pub(super) fn say(&mut self, what: &str, value: impl Into<Value>) {
        self.about.insert(what.into(), value.into());
    }

    /// Adds `events` of `tick` and of cycles before it, which may be cut at `cuts`.
    ///
    /// # Errors
    /// If they cannot be written, as in [`write`](Self::write).
    pub(super) fn add(&mut self, tick: Tick, events: &[u8], cuts: &[Cut]) -> Result<(), (WriteError, Lost)> {
        let begin = self.pending.len();
        self.pending.extend_from_slice(events);
        // What is no cycle may belong to any of them.
        let earliest = cuts.iter().filter_map(|cut| cut.cycle).min().map_or(tick, |cycle| cycle.min(tick));
        self.groups.extend(cuts.iter().map(|cut| Group {
            end: begin + cut.end,
            tick: cut.cycle.unwrap_or(earliest),
            is_cycle: cut.cycle.is_some(),
        }));
        if self.pending.len() >= PIECE || self.written.elapsed() >= AT_LEAST_EVERY {
            self.write()?;
        }
        Ok(())
    }

    /// Writes what is pending.
    ///
    /// # Errors
    /// If not all of it can be written. The file is whole all the same: it ends with the last events that fit, and the
    /// others are lost.
    pub(super) fn write(&mut self) -> Result<(), (WriteError, Lost)> {
        let (pending, groups, end) = (mem::take(&mut self.pending), mem::take(&mut self.groups), self.end());
        let written = self.put(&pending, end.clone());
        let mut lost = Lost::default();
        if written.is_err() {
            // Whatever has been there has room there.
            let there =
                self.file.metadata().map_or(0, |file| file.len().saturating_sub(self.length)) as usize;
            let end = if end.len() <= there { end } else { self.end_written.clone() };
            let room = there.saturating_sub(end.len());
            let (kept, gone) = groups.split_at(groups.partition_point(|group| group.end <= room));
            lost.first_tick = gone.iter().map(|group| group.tick).min();
            lost.cycles = gone.iter().filter(|group| group.is_cycle).count() as u64;
            // If not even this can be done, the reader of the error knows of the file.
            let _ = self.put(&pending[..kept.last().map_or(0, |group| group.end)], end);
        }
        self.written = Instant::now();
        written.map_err(|error| (WriteError::new(&self.path, error), lost))
    }

    /// Puts `events` and `end` where the file ends so far.
    fn put(&mut self, events: &[u8], end: String) -> io::Result<()> {
        self.file.write_all_at(&[events, end.as_bytes()].concat(), self.length)?;
        self.length += events.len() as u64;
        self.file.set_len(self.length + end.len() as u64)?;
        self.end_written = end;
        Ok(())
    }

    fn end(&self) -> String {
        let about = Value::Object(self.about.clone());
        format!("\n],\"displayTimeUnit\":\"ns\",\"otherData\":{about}}}\n")
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn the_file_is_whole_at_any_time_and_says_how_much_room_is_left() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("trace.json");
        let about = Map::from_iter([("robots".into(), 3.into())]);
        let mut file = TraceFile::begin(&path, 400_000, "0", about).unwrap();
        let read = || serde_json::from_slice::<Value>(&fs::read(&path).unwrap()).unwrap();
        assert_eq!(read()["traceEvents"], serde_json::json!([0]));
        file.say("first_tick_left_out", Value::Null);
        let many = ",1".repeat(PIECE / 2);
        file.add(0, many.as_bytes(), &[]).unwrap();
        assert_eq!(read()["traceEvents"].as_array().unwrap().len(), 1 + PIECE / 2, "a piece is written");
        file.add(0, b",2", &[]).unwrap();
        file.say("first_tick_left_out", 7);
        let room = file.room();
        file.add(0, ",3".repeat(room as usize / 2).as_bytes(), &[]).unwrap();
        file.write().unwrap();
        let whole = read();
        assert_eq!(whole["otherData"], serde_json::json!({ "robots": 3, "first_tick_left_out": 7 }));
        assert_eq!(whole["displayTimeUnit"], "ns");
        let bytes = fs::metadata(&path).unwrap().len();
        assert!((399_998..=400_000).contains(&bytes), "{bytes}");
        assert_eq!(
            TraceFile::begin(&path, 1, "0", Map::new()).unwrap_err().to_string(),
            format!("cannot write {}: File exists (os error 17)", path.display())
        );
    }
}

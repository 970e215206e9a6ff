//! The file of a trace: whole at any time, and never longer than it may be.
//!
//! ```text
//! {"traceEvents":[
//!   events ...
//! ],"displayTimeUnit":"ns","otherData":{ ... }}
//! ```
//!
//! What ends it is written with every piece, and written over by the next one. So a run that is killed leaves a trace
//! that can be read.

use std::{
    fs::File,
    io,
    os::unix::fs::FileExt,
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

use serde_json::{Map, Value};

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
    /// What follows it, and is not written yet.
    pending: Vec<u8>,
    bytes_max: u64,
    written: Instant,
    /// What is said about the trace at its end.
    about: Map<String, Value>,
}

impl TraceFile {
    /// Begins a new file at `path` with `first`, the text of an event, and what is said `about` it at its end. It
    /// grows to `bytes_max` at most, if only `first` and `about` are shorter.
    ///
    /// # Errors
    /// If it is there already, or cannot be written.
    pub(super) fn begin(
        path: &Path,
        bytes_max: u64,
        first: &str,
        about: Map<String, Value>,
    ) -> io::Result<Self> {
        let mut file = Self {
            path: path.into(),
            file: File::create_new(path)?,
            length: 0,
            pending: format!("{{\"traceEvents\":[\n{first}").into_bytes(),
            bytes_max,
            written: Instant::now(),
            about,
        };
        file.write()?;
        Ok(file)
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

    /// Adds events.
    ///
    /// # Errors
    /// If it cannot be written.
    pub(super) fn add(&mut self, events: &[u8]) -> io::Result<()> {
        self.pending.extend_from_slice(events);
        if self.pending.len() >= PIECE || self.written.elapsed() >= AT_LEAST_EVERY {
            self.write()?;
        }
        Ok(())
    }

    /// Writes what is pending.
    ///
    /// # Errors
    /// If it cannot be written.
    pub(super) fn write(&mut self) -> io::Result<()> {
        let (grown, end) = (self.pending.len(), self.end());
        self.pending.extend_from_slice(end.as_bytes());
        let written = self.file.write_all_at(&self.pending, self.length);
        let whole = written.and_then(|()| self.file.set_len(self.length + self.pending.len() as u64));
        self.pending.clear();
        self.length += grown as u64;
        self.written = Instant::now();
        whole
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
        file.add(many.as_bytes()).unwrap();
        assert_eq!(read()["traceEvents"].as_array().unwrap().len(), 1 + PIECE / 2, "a piece is written");
        file.add(b",2").unwrap();
        file.say("first_tick_left_out", 7);
        let room = file.room();
        file.add(",3".repeat(room as usize / 2).as_bytes()).unwrap();
        file.write().unwrap();
        let whole = read();
        assert_eq!(whole["otherData"], serde_json::json!({ "robots": 3, "first_tick_left_out": 7 }));
        assert_eq!(whole["displayTimeUnit"], "ns");
        let bytes = fs::metadata(&path).unwrap().len();
        assert!((399_998..=400_000).contains(&bytes), "{bytes}");
        assert_eq!(
            TraceFile::begin(&path, 1, "0", Map::new()).unwrap_err().kind(),
            io::ErrorKind::AlreadyExists
        );
    }
}

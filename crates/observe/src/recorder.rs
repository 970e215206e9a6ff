//! The recording of a run (`--record`): an MCAP file, which a thread of its own writes.
//!
//! Each tick hands over what it was; turning that into messages, compressing and writing is the thread's. So no tick waits
//! for the disk, unless that is so slow that [`QUEUE_TICKS`] of them wait for it: nothing is left out.

use std::{
    fs::{self, File},
    io::{self, BufWriter},
    path::{Path, PathBuf},
    sync::mpsc::{self, Receiver, RecvTimeoutError, SyncSender, TrySendError},
    thread::{self, JoinHandle},
    time::{Duration, Instant},
};

use clap::ValueEnum;
use engine::{Acted, Incident, Observer, ObserverError, RunInfo, TickView, summary::Summary};
use files::WriteError;
use recording::{Message, Topic, Writer};
use scenario::Scenario;
use serde::{Deserialize, Serialize};

use crate::messages::{Extent, Messages, Note, NoteTaker, Sink};

/// Name of the file in the run's folder.
pub const FILE: &str = "run.mcap";
/// Ticks that may wait for the thread; a tick beyond them waits itself.
pub const QUEUE_TICKS: usize = 256;
/// No more of a run than this is lost whatever ends the process.
const FLUSH_EVERY: Duration = Duration::from_secs(1);

/// How much is recorded, as the command line spells it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum RecordExtent {
    /// Places and shapes that viewers draw, and hashes that prove what happened
    #[default]
    Plain,
    /// Percepts and answers of every robot too, to the bit
    Full,
}

/// Records a run.
#[derive(Debug)]
pub struct Recorder {
    path: PathBuf,
    taker: NoteTaker,
    notes: Option<SyncSender<Note>>,
    /// How often a tick had to wait for the thread.
    waited: u64,
    writer: Option<JoinHandle<Result<(), recording::WriteError>>>,
}

type Recording = Writer<BufWriter<File>>;

impl Sink for Recording {
    type Error = recording::WriteError;

    fn take(&mut self, topic: Topic, time_ns: u64, message: &impl Message) -> Result<(), Self::Error> {
        self.write(topic, time_ns, message)
    }
}

impl Recorder {
    /// Begins the recording of a run of `scenario` in `folder`.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn begin(folder: &Path, scenario: &Scenario, extent: RecordExtent) -> Result<Self, WriteError> {
        let path = folder.join(FILE);
        let failed = |error| WriteError::new(&path, error);
        let file = File::create_new(&path).map_err(failed)?;
        let writer = Writer::new(BufWriter::new(file)).map_err(|error| {
            // The next attempt would find it in the way.
            let _ = fs::remove_file(&path);
            failed(error.into())
        })?;
        let (notes, received) = mpsc::sync_channel(QUEUE_TICKS);
        let messages = Messages::of(scenario);
        let writer = thread::spawn(move || write(writer, &received, messages));
        let extent = match extent {
            RecordExtent::Plain => Extent::Plain,
            RecordExtent::Full => Extent::Full,
        };
        let taker = NoteTaker::new(scenario, extent);
        Ok(Self { path, taker, notes: Some(notes), waited: 0, writer: Some(writer) })
    }

    fn tell(&mut self, note: Note) -> Result<(), ObserverError> {
        let Some(notes) = &self.notes else { return Ok(()) };
        let is_told = match notes.try_send(note) {
            Ok(()) => true,
            Err(TrySendError::Full(note)) => {
                self.waited += 1;
                notes.send(note).is_ok()
            }
            Err(TrySendError::Disconnected(_)) => false,
        };
        // If it has ended, it says why.
        if is_told { Ok(()) } else { self.end() }
    }

    /// Tells what no tick waits for. That the thread has ended is told with the next tick.
    fn mention(&self, note: Note) {
        let _ = self.notes.as_ref().map(|notes| notes.send(note));
    }

    /// Waits for the thread to end.
    fn end(&mut self) -> Result<(), ObserverError> {
        self.notes = None;
        let ended = self.writer.take().map(JoinHandle::join);
        let outcome = match ended {
            None | Some(Ok(Ok(()))) => return Ok(()),
            Some(Ok(Err(error))) => error.into(),
            Some(Err(_)) => io::Error::other("the thread that writes it has panicked"),
        };
        let error = WriteError::new(&self.path, outcome);
        Err(ObserverError::Broken(format!("{error}; the recording ends there")))
    }
}

impl Observer for Recorder {
    fn started(&mut self, run: &RunInfo<'_>) -> Result<(), ObserverError> {
        self.tell(self.taker.begun(run))
    }

    fn ticked(&mut self, view: &TickView<'_>) -> Result<(), ObserverError> {
        let mut changed = Vec::new();
        self.taker.changed(view, |note| changed.push(note));
        changed.into_iter().try_for_each(|note| self.tell(note))?;
        self.tell(self.taker.ticked(view))
    }

    fn wants_losses(&self) -> bool {
        self.taker.wants_losses()
    }

    fn incident(&mut self, incident: &Incident) {
        self.mention(self.taker.incident(incident));
    }

    fn acted(&mut self, acted: &Acted<'_>) {
        self.mention(self.taker.acted(acted));
    }

    fn finished(&mut self, end: &TickView<'_>, summary: &Summary) -> Result<(), ObserverError> {
        self.tell(self.taker.ended(end.tick(), summary.json()))?;
        if self.waited > 0 {
            tracing::warn!(
                "the run waited for its recording {} times: the disk is slower than it",
                self.waited
            );
        }
        self.end()
    }
}

/// Writes what it is told until nobody tells any more.
fn write(
    mut file: Recording,
    notes: &Receiver<Note>,
    mut messages: Messages,
) -> Result<(), recording::WriteError> {
    let (mut is_flushed, mut flushed) = (true, Instant::now());
    loop {
        let left = FLUSH_EVERY.saturating_sub(flushed.elapsed());
        match notes.recv_timeout(left) {
            Ok(note) => {
                if is_flushed {
                    (is_flushed, flushed) = (false, Instant::now());
                }
                messages.tell(&mut file, &note)?;
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return file.finish(),
        }
        if flushed.elapsed() >= FLUSH_EVERY {
            if !is_flushed {
                file.flush()?;
            }
            (is_flushed, flushed) = (true, Instant::now());
        }
    }
}

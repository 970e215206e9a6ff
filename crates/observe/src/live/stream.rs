//! A run as messages, pushed to those who watch it from another process: the socket `watch` in the run's folder.
//!
//! Each client has a thread, which makes messages of what it is told and writes them. A tick that comes while
//! `TICKS_UNDER_WAY` wait for a client is not told to it, and is counted; acts, faults and incidents are told to
//! everybody. So no tick waits for whoever watches.

use std::{
    fs,
    io::{self, BufWriter},
    os::unix::{
        fs::PermissionsExt,
        net::{UnixListener, UnixStream},
    },
    path::Path,
    sync::{
        Arc, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicUsize, Ordering},
        mpsc::{self, Receiver, Sender, TryRecvError},
    },
    thread::{self, JoinHandle},
    time::{Duration, Instant},
};

use engine::{Acted, Incident, Observer, ObserverError, RunInfo, TickView, summary::Summary};
use recording::{Message, StreamReader, StreamWriter, Topic};
use scenario::Scenario;

use super::state::Live;
use crate::messages::{Extent, Messages, Note, NoteTaker, Sink};

/// Ticks that wait for a client at most.
const TICKS_UNDER_WAY: usize = 2;
/// Most clients; one more is turned away.
const CLIENTS_MAX: usize = 8;
/// How long a client may not read before it is dropped.
const PATIENCE: Duration = Duration::from_secs(10);
/// How long clients get at the end to read what is left.
const FAREWELL: Duration = Duration::from_secs(1);

/// Tells a run to those who watch.
#[derive(Debug)]
pub struct Broadcaster {
    clients: Arc<Clients>,
    taker: NoteTaker,
}

struct Clients {
    live: Arc<Live>,
    scenario: Scenario,
    /// How many there are.
    count: AtomicUsize,
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    /// All that every client is told, also one that comes later.
    told: Vec<Arc<Note>>,
    clients: Vec<Client>,
    is_over: bool,
}

struct Client {
    notes: Sender<Arc<Note>>,
    under_way: Arc<AtomicUsize>,
    writer: JoinHandle<()>,
}

type Socket = StreamWriter<BufWriter<UnixStream>>;

impl Sink for Socket {
    type Error = io::Error;

    fn take(&mut self, topic: Topic, time_ns: u64, message: &impl Message) -> io::Result<()> {
        self.write(topic, time_ns, message)
    }
}

impl std::fmt::Debug for Clients {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} clients", self.count.load(Ordering::Relaxed))
    }
}

impl Broadcaster {
    /// Tells a run of `scenario` to whoever connects at `path`, in the run's folder, until this process ends. The socket is
    /// for its owner alone, and is removed with the folder.
    ///
    /// # Errors
    /// If the socket cannot be made.
    pub fn serve(path: &Path, scenario: &Scenario, live: Arc<Live>) -> io::Result<Self> {
        let listener = UnixListener::bind(path)?;
        fs::set_permissions(path, fs::Permissions::from_mode(0o600))?;
        let (scenario, count, state) = (scenario.clone(), AtomicUsize::new(0), Mutex::default());
        let taker = NoteTaker::new(&scenario, Extent::Live);
        let clients = Arc::new(Clients { live, scenario, count, state });
        let admitting = Arc::clone(&clients);
        thread::Builder::new().name("watch".into()).spawn(move || {
            listener.incoming().flatten().for_each(|stream| {
                // One that cannot be told anything goes, and says so to its own side.
                let _ = admitting.admit(stream);
            });
        })?;
        Ok(Self { clients, taker })
    }
}

/// Connects to the run whose socket is at `path`.
///
/// # Errors
/// `NotFound` if the run cannot be watched or has ended; `ConnectionRefused` if its arena has just ended.
pub fn watch(path: &Path) -> io::Result<StreamReader<io::BufReader<UnixStream>>> {
    let stream = UnixStream::connect(path)?;
    Ok(StreamReader::new(io::BufReader::with_capacity(1 << 16, stream)))
}

impl Clients {
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn admit(&self, stream: UnixStream) -> io::Result<()> {
        stream.set_write_timeout(Some(PATIENCE))?;
        let mut state = self.state();
        state.clients.retain(|client| !client.writer.is_finished());
        if state.is_over || state.clients.len() == CLIENTS_MAX {
            return Ok(());
        }
        let (notes, told) = mpsc::channel();
        let under_way = Arc::new(AtomicUsize::new(0));
        for note in &state.told {
            let _ = notes.send(Arc::clone(note));
        }
        let (messages, waiting) = (Messages::of(&self.scenario), Arc::clone(&under_way));
        let writer = thread::Builder::new().name("watch-client".into()).spawn(move || {
            // A client that has gone, or does not read, is told no more.
            let _ = write(stream, &told, messages, &waiting);
        })?;
        state.clients.push(Client { notes, under_way, writer });
        self.count.store(state.clients.len(), Ordering::Relaxed);
        Ok(())
    }

    /// Tells everybody, now or when they come.
    fn tell(&self, note: Note) {
        let note = Arc::new(note);
        let mut state = self.state();
        state.told.push(Arc::clone(&note));
        self.send(&mut state, |client| client.notes.send(Arc::clone(&note)).is_ok());
    }

    /// Tells of a tick those who have read the ones before it.
    fn tell_tick(&self, tick: impl FnOnce() -> Note) {
        if self.count.load(Ordering::Relaxed) == 0 {
            return;
        }
        let mut state = self.state();
        let reads = |client: &Client| client.under_way.load(Ordering::Relaxed) < TICKS_UNDER_WAY;
        let late = state.clients.iter().filter(|client| !reads(client)).count();
        if late > 0 {
            self.live.tell(|snapshot| snapshot.dropped.ticks += late as u64);
        }
        if late == state.clients.len() {
            return;
        }
        let note = Arc::new(tick());
        self.send(&mut state, |client| {
            if !reads(client) {
                return true;
            }
            client.under_way.fetch_add(1, Ordering::Relaxed);
            client.notes.send(Arc::clone(&note)).is_ok()
        });
    }

    /// Tells each of them; one that is no longer there is forgotten.
    fn send(&self, state: &mut State, tell: impl FnMut(&mut Client) -> bool) {
        state.clients.retain_mut(tell);
        self.count.store(state.clients.len(), Ordering::Relaxed);
    }

    /// The run is over: clients get some time to read what is left.
    fn end(&self) {
        let mut state = self.state();
        state.is_over = true;
        let writers: Vec<_> = state.clients.drain(..).map(|client| client.writer).collect();
        drop(state);
        let until = Instant::now() + FAREWELL;
        while writers.iter().any(|writer| !writer.is_finished()) && Instant::now() < until {
            thread::sleep(Duration::from_millis(1));
        }
    }
}

/// Writes what it is told until nobody tells any more.
fn write(
    stream: UnixStream,
    told: &Receiver<Arc<Note>>,
    mut messages: Messages,
    under_way: &AtomicUsize,
) -> io::Result<()> {
    let mut to = Socket::new(BufWriter::with_capacity(1 << 16, stream));
    loop {
        let note = match told.try_recv() {
            Ok(note) => note,
            Err(TryRecvError::Disconnected) => return to.flush(),
            Err(TryRecvError::Empty) => {
                to.flush()?;
                let Ok(note) = told.recv() else { return Ok(()) };
                note
            }
        };
        messages.tell(&mut to, &note)?;
        if matches!(*note, Note::Tick(_)) {
            under_way.fetch_sub(1, Ordering::Relaxed);
        }
    }
}

impl Observer for Broadcaster {
    fn started(&mut self, run: &RunInfo<'_>) -> Result<(), ObserverError> {
        self.clients.tell(self.taker.begun(run));
        Ok(())
    }

    fn ticked(&mut self, view: &TickView<'_>) -> Result<(), ObserverError> {
        self.taker.changed(view, |note| self.clients.tell(note));
        self.clients.tell_tick(|| self.taker.ticked(view));
        Ok(())
    }

    fn wants_losses(&self) -> bool {
        self.clients.count.load(Ordering::Relaxed) > 0
    }

    fn incident(&mut self, incident: &Incident) {
        self.clients.tell(self.taker.incident(incident));
    }

    fn acted(&mut self, acted: &Acted<'_>) {
        self.clients.tell(self.taker.acted(acted));
    }

    fn finished(&mut self, end: &TickView<'_>, summary: &Summary) -> Result<(), ObserverError> {
        self.clients.tell(self.taker.ended(end.tick(), summary.json()));
        self.clients.end();
        Ok(())
    }
}

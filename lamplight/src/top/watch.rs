//! Asks a run how it is, again and again, and shows it until somebody has seen enough or it ends.

use std::{
    collections::HashMap,
    io::{self, ErrorKind},
    process,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    thread,
    time::{Duration, Instant},
};

use anyhow::{Context, anyhow};
use engine::StopFlag;
use observe::live::{Snapshot, socket};
use processes::{Process, cpu::Cpu, signals::raise_on_stop};
use ratatui::{
    DefaultTerminal,
    crossterm::event::{self, Event, KeyCode, KeyEvent, KeyEventKind, KeyModifiers},
};
use transport::run_dir::RunDir;

use super::{rates::Rates, screen::Screen};
use signal_hook::{
    consts::{SIGCONT, SIGSTOP, SIGTSTP},
    flag,
    low_level::raise,
};

use crate::{failure::Failure, stdout::say};

/// Time between two looks at the run.
const EVERY: Duration = Duration::from_millis(200);
/// How long a run gets that has just begun, to make its socket.
const BEGINS: Duration = Duration::from_secs(1);
/// Time between two tries meanwhile.
const TRY: Duration = Duration::from_millis(20);

/// Answer of a run to a question.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Asked {
    /// How it is.
    Told,
    /// Nothing, though it is alive.
    Silent,
    /// It is no longer alive.
    Ended,
}

/// Watches one run.
pub(super) struct Watcher {
    run: RunDir,
    began: Instant,
    last: Option<Snapshot>,
    /// Since when it is silent.
    silent: Option<Instant>,
    rates: Rates,
    cpu: Cpu,
    shares: HashMap<u32, f64>,
    pub(super) screen: Screen,
}

impl Watcher {
    pub(super) fn of(run: RunDir) -> Self {
        Self {
            run,
            began: Instant::now(),
            last: None,
            silent: None,
            rates: Rates::default(),
            cpu: Cpu::default(),
            shares: HashMap::new(),
            screen: Screen::default(),
        }
    }

    /// Asks the run how it is.
    pub(super) fn ask(&mut self) -> Result<Asked, Failure> {
        let asked = Instant::now();
        loop {
            match socket::ask(&self.run.live_path()) {
                Ok(snapshot) => {
                    self.rates.note(Instant::now(), snapshot.tick, snapshot.time_s);
                    let shown = self.screen.shown(&snapshot);
                    self.shares = self.cpu.shares(shown.filter_map(|robot| robot.pid));
                    (self.last, self.silent) = (Some(snapshot), None);
                    return Ok(Asked::Told);
                }
                Err(_) if RunDir::open(self.run.name().clone()).is_err() => return Ok(Asked::Ended),
                Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {
                    self.silent.get_or_insert(asked);
                    return Ok(Asked::Silent);
                }
                // It has just begun, or is just about to end.
                Err(_) if self.began.elapsed() < BEGINS || self.last.is_some() => thread::sleep(TRY),
                Err(error) => {
                    let name = self.run.name();
                    let why = match error.kind() {
                        ErrorKind::NotFound => "it is a batch, or of another version".into(),
                        _ => error.to_string(),
                    };
                    return Err(Failure::Run(anyhow!("run `{name}` cannot be watched: {why}")));
                }
            }
        }
    }

    /// Returns the view; `None` before the run has told anything.
    pub(super) fn view(&self) -> Option<super::View<'_>> {
        Some(super::View {
            snapshot: self.last.as_ref()?,
            rate: self.rates.rate(),
            shares: &self.shares,
            silence: self.silent.map(|_| self.silence()),
            screen: &self.screen,
        })
    }

    /// The run is alive and says nothing.
    pub(super) fn silence(&self) -> String {
        let seconds = self.silent.map_or(0.0, |since| since.elapsed().as_secs_f64());
        let arena = self.last.as_ref().map(|last| last.of.arena_pid);
        let state = arena.and_then(Process::find).map(|process| process.state());
        match (arena, state) {
            (Some(pid), Some(state)) => {
                format!("the arena (pid {pid}, {state}) has not answered for {seconds:.1} s")
            }
            _ => format!("the arena has not answered for {seconds:.1} s"),
        }
    }

    /// The run is over.
    pub(super) fn farewell(&self) -> String {
        format!("run `{}` has ended\n", self.run.name())
    }
}

/// Time to leave in order after a signal.
const GRACE: Duration = Duration::from_secs(1);

/// Shows the run until it ends, or a key or a signal says that it is enough.
pub(super) fn show(watcher: &mut Watcher) -> Result<(), Failure> {
    let stop = StopFlag::default();
    raise_on_stop(&stop).context("cannot listen for signals").map_err(Failure::Run)?;
    leave_a_lost_terminal(stop.clone());
    // Before the terminal is taken: what is wrong at once is said on it as it is.
    let mut asked = watcher.ask()?;
    let shown = if asked == Asked::Ended {
        Ok(asked)
    } else {
        // Gives the terminal back before the message of a panic, too.
        let mut terminal = ratatui::try_init().map_err(Failure::run)?;
        let job = Job::begin().context("cannot listen for signals").map_err(Failure::Run)?;
        let shown: Result<Asked, Failure> = (|| {
            while asked != Asked::Ended && !stop.is_raised() {
                draw(&mut terminal, watcher)?;
                match follow_keys(watcher)? {
                    Wish::Leave => break,
                    Wish::Stop => job.ask_to_stop(),
                    Wish::Stay => {}
                }
                if job.has_been_away()? {
                    terminal = ratatui::try_init().map_err(Failure::run)?;
                }
                asked = watcher.ask()?;
            }
            Ok(asked)
        })();
        ratatui::restore();
        shown
    };
    match shown? {
        Asked::Ended => say(&watcher.farewell()),
        Asked::Told | Asked::Silent => Ok(()),
    }
}

/// Waiting for keys of a terminal that has gone away never ends, and takes a whole core. Its hangup is a signal: who
/// has not left a moment after one does not wait any longer.
fn leave_a_lost_terminal(stop: StopFlag) {
    thread::spawn(move || {
        while !stop.is_raised() {
            thread::sleep(EVERY);
        }
        thread::sleep(GRACE);
        ratatui::restore();
        process::exit(stop.signal().map_or(1, |signal| 128 + signal));
    });
}

fn draw(terminal: &mut DefaultTerminal, watcher: &Watcher) -> Result<(), Failure> {
    terminal
        .draw(|frame| match watcher.view() {
            Some(view) => frame.render_widget(view, frame.area()),
            None => frame.render_widget(watcher.silence(), frame.area()),
        })
        .map(drop)
        .map_err(Failure::run)
}

/// The shell's hold on this process: Ctrl-Z and `fg`.
struct Job {
    to_stop: Arc<AtomicBool>,
    continued: Arc<AtomicBool>,
}

impl Job {
    fn begin() -> io::Result<Self> {
        let job = Self { to_stop: Arc::default(), continued: Arc::default() };
        flag::register(SIGTSTP, Arc::clone(&job.to_stop))?;
        flag::register(SIGCONT, Arc::clone(&job.continued))?;
        Ok(job)
    }

    fn ask_to_stop(&self) {
        self.to_stop.store(true, Ordering::Relaxed);
    }

    /// Stops this process if it is asked to, and gives the terminal back for that time. Returns whether it has been
    /// stopped, by whomever: then the shell has had the terminal, which must be taken anew.
    fn has_been_away(&self) -> Result<bool, Failure> {
        if self.to_stop.swap(false, Ordering::Relaxed) {
            ratatui::restore();
            raise(SIGSTOP).map_err(Failure::run)?;
            self.continued.store(true, Ordering::Relaxed);
        }
        Ok(self.continued.swap(false, Ordering::Relaxed))
    }
}

/// Wish that a key stands for.
enum Wish {
    /// Nothing, or something else to be seen.
    Stay,
    /// That is enough.
    Leave,
    /// Ctrl-Z, which is a key while the terminal is ours.
    Stop,
}

/// Until the next look: follows keys.
fn follow_keys(watcher: &mut Watcher) -> Result<Wish, Failure> {
    let due = Instant::now() + EVERY;
    loop {
        let left = due.saturating_duration_since(Instant::now());
        let event = match event::poll(left).and_then(|comes| comes.then(event::read).transpose()) {
            Ok(Some(event)) => event,
            Ok(None) => return Ok(Wish::Stay),
            // A signal.
            Err(error) if error.kind() == io::ErrorKind::Interrupted => return Ok(Wish::Stay),
            Err(error) => return Err(Failure::run(error)),
        };
        match event {
            Event::Key(KeyEvent { code, modifiers, kind: KeyEventKind::Press, .. }) => match code {
                KeyCode::Char('q') | KeyCode::Esc => return Ok(Wish::Leave),
                KeyCode::Char('c') if modifiers.contains(KeyModifiers::CONTROL) => {
                    return Ok(Wish::Leave);
                }
                KeyCode::Char('z') if modifiers.contains(KeyModifiers::CONTROL) => return Ok(Wish::Stop),
                KeyCode::Char('s') => watcher.screen.sort_next(),
                KeyCode::Down | KeyCode::Char('j') => watcher.screen.scroll(1),
                KeyCode::Up | KeyCode::Char('k') => watcher.screen.scroll(-1),
                KeyCode::PageDown => watcher.screen.scroll(10),
                KeyCode::PageUp => watcher.screen.scroll(-10),
                KeyCode::Home => watcher.screen.scroll(isize::MIN),
                _ => continue,
            },
            Event::Resize(..) => {}
            _ => continue,
        }
        // What has changed is to be seen at once.
        return Ok(Wish::Stay);
    }
}

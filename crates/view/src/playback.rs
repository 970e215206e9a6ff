//! A recording that plays, as a source of what is shown: at any speed, from any time.

use std::{
    fs::File,
    io::{self, BufReader},
    path::{Path, PathBuf},
    sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError},
    thread,
    time::{Duration, Instant},
};

use engine::act::{Act, Done, Refused};
use recording::{Reader, Topic};
use scenario::Scenario;

use crate::{
    session::{Hub, Show, Source},
    swarm::{About, Swarm},
    wire::{EventKind, PageAct},
};

struct Playback {
    path: PathBuf,
    hub: Hub,
    control: Mutex<Control>,
    changed: Condvar,
}

/// How the recording is to play.
#[derive(Clone, Copy, Debug)]
struct Control {
    is_held: bool,
    /// Ticks that may pass though it is held.
    steps: u64,
    /// Virtual seconds per real second; `None` for as fast as it can.
    speed: Option<f64>,
    /// Time to go to, seconds.
    seek_s: Option<f64>,
    /// Raised by each change of the pace.
    version: u64,
}

/// Turn of a tick.
enum Turn {
    Passes,
    /// The recording is to be read again from its beginning.
    Rewinds,
}

/// Plays the recording at `path`, of a run of `scenario`, at the speed of the run's time.
///
/// # Errors
/// If it cannot be opened, or no thread be made for it.
pub fn playback(path: &Path, scenario: Scenario, about: About) -> io::Result<Show> {
    let mut swarm = Swarm::new(about, scenario);
    swarm.speed = Some(1.0);
    let control = Control { is_held: false, steps: 0, speed: Some(1.0), seek_s: None, version: 0 };
    let source = Arc::new(Playback {
        path: path.into(),
        hub: Hub::new(swarm),
        control: Mutex::new(control),
        changed: Condvar::new(),
    });
    let file = source.open()?;
    let playing = Arc::clone(&source);
    thread::Builder::new().name("playback".into()).spawn(move || playing.play(file))?;
    Ok(Show(source))
}

type Recording = Reader<BufReader<File>>;

impl Playback {
    fn open(&self) -> io::Result<Recording> {
        File::open(&self.path).map(|file| Reader::new(BufReader::new(file)))
    }

    fn control(&self) -> MutexGuard<'_, Control> {
        self.control.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Plays again and again, whenever somebody goes back.
    fn play(&self, first: Recording) {
        let mut recording = Ok(first);
        loop {
            match recording.and_then(|recording| self.play_through(recording)) {
                Ok(()) => {}
                Err(error) => {
                    let mut swarm = self.hub.swarm();
                    let time_s = swarm.time_s;
                    swarm.add_event(
                        time_s,
                        EventKind::End,
                        format!("the recording cannot be read on: {error}"),
                    );
                }
            }
            self.hub.swarm().is_over = true;
            let mut control = self.control();
            while control.seek_s.is_none() {
                control = self.changed.wait(control).unwrap_or_else(PoisonError::into_inner);
            }
            drop(control);
            self.hub.swarm().rewind();
            recording = self.open();
        }
    }

    /// Plays until the end, or until somebody goes back.
    fn play_through(&self, mut recording: Recording) -> io::Result<()> {
        let mut pace = (Instant::now(), 0.0, u64::MAX);
        while let Some(entry) = recording.next_entry().map_err(io::Error::other)? {
            if entry.topic == Topic::Robots {
                let time_s = entry.time_ns as f64 / 1e9;
                if let Turn::Rewinds = self.wait_for(time_s, &mut pace) {
                    return Ok(());
                }
            }
            self.hub.swarm().apply(&entry).map_err(io::Error::other)?;
        }
        Ok(())
    }

    /// Waits until the tick at `time_s` is due. `pace` is when a time was reached, that time, and the version of the control
    /// it counts by.
    fn wait_for(&self, time_s: f64, pace: &mut (Instant, f64, u64)) -> Turn {
        let mut control = self.control();
        loop {
            if let Some(to_s) = control.seek_s {
                if to_s < self.hub.swarm().time_s {
                    return Turn::Rewinds;
                }
                if time_s >= to_s {
                    // It is shown, held or not, and time goes on from there.
                    control.seek_s = None;
                    pace.2 = u64::MAX;
                }
                return Turn::Passes;
            }
            if control.version != pace.2 {
                *pace = (Instant::now(), time_s, control.version);
            }
            let now = Instant::now();
            let due = match (control.is_held, control.steps, control.speed) {
                (true, 0, _) => None,
                (true, ..) => {
                    control.steps -= 1;
                    return Turn::Passes;
                }
                (false, _, None) => return Turn::Passes,
                (false, _, Some(speed)) => {
                    let after = Duration::try_from_secs_f64((time_s - pace.1) / speed);
                    Some(pace.0 + after.unwrap_or(Duration::from_secs(3600)))
                }
            };
            control = match due {
                Some(due) if due <= now => return Turn::Passes,
                Some(due) => {
                    let waited = self.changed.wait_timeout(control, due - now);
                    waited.unwrap_or_else(PoisonError::into_inner).0
                }
                None => self.changed.wait(control).unwrap_or_else(PoisonError::into_inner),
            };
        }
    }
}

impl Source for Playback {
    fn hub(&self) -> &Hub {
        &self.hub
    }

    fn act(&self, act: PageAct) -> Result<Done, Refused> {
        let mut control = self.control();
        match act {
            PageAct::Seek(seek) if seek.time_s.is_finite() => control.seek_s = Some(seek.time_s.max(0.0)),
            PageAct::Run(Act::Pause) => (control.is_held, control.steps) = (true, 0),
            PageAct::Run(Act::Resume) => (control.is_held, control.steps) = (false, 0),
            PageAct::Run(Act::Step { ticks }) => {
                control.is_held = true;
                control.steps = control.steps.saturating_add(ticks);
            }
            PageAct::Run(Act::Speed { factor }) if factor.is_none_or(|it| it > 0.0 && it.is_finite()) => {
                control.speed = factor;
            }
            PageAct::Seek(_) | PageAct::Run(Act::Speed { .. }) => {
                return Err("that is no number to go by".into());
            }
            PageAct::Run(_) => return Err("a recording is what has happened".into()),
        }
        control.version += 1;
        let (is_held, speed) = (control.is_held, control.speed);
        drop(control);
        self.changed.notify_all();
        let mut swarm = self.hub.swarm();
        (swarm.is_held, swarm.speed) = (is_held, speed);
        Ok(Done { tick: swarm.tick, ..Done::default() })
    }
}

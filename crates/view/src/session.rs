//! One open page: what it is told, and what it asks for.

use std::{
    sync::{
        Arc, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicUsize, Ordering},
    },
    thread,
    time::{Duration, Instant},
};

use axum::{
    body::Bytes,
    extract::ws::{Message, WebSocket},
};
use engine::act::{Done, Refused};
use tokio::{
    select,
    sync::mpsc,
    time::{MissedTickBehavior, interval, timeout},
};

use crate::{
    frame::{self, Shown},
    inspect,
    swarm::{FrameId, Swarm, Versions},
    tell, wire,
    wire::{PageAct, Said, Told},
};

/// Time between two frames: 25 a second.
const FRAME: Duration = Duration::from_millis(40);
/// Frames that the page may have and not have drawn.
const UNDRAWN_MAX: u32 = 2;
/// Between two states, two looks at a robot, two tables of agents.
const STATE: Duration = Duration::from_millis(250);
const ROBOT: Duration = Duration::from_millis(200);
const AGENTS: Duration = Duration::from_secs(1);
/// How long a page may not read before it is dropped.
const PATIENCE: Duration = Duration::from_secs(10);
/// How long pages get at the end to be told of it.
const FAREWELL: Duration = Duration::from_secs(1);
/// Acts of a page that wait for a tick.
const ACTS_MAX: usize = 8;

/// Something that a page can show: a run under way, or a recording that plays.
pub struct Show(pub(crate) Arc<dyn Source>);

/// Where what is shown comes from.
pub(crate) trait Source: Send + Sync {
    /// The swarm as it is known.
    fn hub(&self) -> &Hub;

    /// Does what a page asks for; may wait for a tick.
    fn act(&self, act: PageAct) -> Result<Done, Refused>;
}

/// Counts open pages that have not been told of the end.
#[derive(Clone, Debug, Default)]
pub(crate) struct Untold(Arc<AtomicUsize>);

impl Untold {
    /// Waits until they have been, but not for long.
    pub(crate) fn wait(&self) {
        let until = Instant::now() + FAREWELL;
        while self.0.load(Ordering::Relaxed) > 0 && Instant::now() < until {
            thread::sleep(FRAME / 4);
        }
    }
}

/// One page of them.
struct UntoldPage(Untold);

impl UntoldPage {
    fn of(untold: Untold) -> Self {
        untold.0.fetch_add(1, Ordering::Relaxed);
        Self(untold)
    }
}

impl Drop for UntoldPage {
    fn drop(&mut self) {
        self.0.0.fetch_sub(1, Ordering::Relaxed);
    }
}

/// A swarm that a source changes and pages show.
pub(crate) struct Hub {
    swarm: Mutex<Swarm>,
    /// The last frame: pages that show the same share it.
    frame: Mutex<Option<(FrameId, Shown, Bytes)>>,
}

impl Hub {
    pub(crate) fn new(swarm: Swarm) -> Self {
        Self { swarm: Mutex::new(swarm), frame: Mutex::new(None) }
    }

    pub(crate) fn swarm(&self) -> MutexGuard<'_, Swarm> {
        self.swarm.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The frame that there is now, if it is another than `known`.
    fn frame(&self, shown: Shown, known: Option<FrameId>) -> Option<(FrameId, Bytes)> {
        let mut swarm = self.swarm();
        let id = swarm.frame_id(shown.cells || shown.global);
        if known == Some(id) || swarm.number == 0 {
            return None;
        }
        let mut last = self.frame.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((of, like, bytes)) = &*last
            && (*of, *like) == (id, shown)
        {
            return Some((id, bytes.clone()));
        }
        let bytes = Bytes::from(frame::encode(&swarm, shown));
        *last = Some((id, shown, bytes.clone()));
        Some((id, bytes))
    }
}

/// State of one page: what it has been told, and what it wants.
struct Session {
    source: Arc<dyn Source>,
    shown: Shown,
    robot: Option<u32>,
    /// The last frame, and how many are not drawn.
    frame: Option<FrameId>,
    undrawn: u32,
    versions: Option<Versions>,
    points: usize,
    events: usize,
    told_state: Option<Instant>,
    told_robot: Option<Instant>,
    told_agents: Option<Instant>,
    is_over: bool,
    acts: usize,
}

/// Talks to a page until it goes, does not read, or says what is not understood.
pub(crate) async fn talk(mut socket: WebSocket, source: Arc<dyn Source>, untold: Untold) {
    let mut untold = Some(UntoldPage::of(untold));
    let mut session = Session {
        source,
        shown: Shown { cells: true, global: false, edges: false },
        robot: None,
        frame: None,
        undrawn: 0,
        versions: None,
        points: 0,
        events: 0,
        told_state: None,
        told_robot: None,
        told_agents: None,
        is_over: false,
        acts: 0,
    };
    let (done, mut dones) = mpsc::unbounded_channel();
    let mut frames = interval(FRAME);
    frames.set_missed_tick_behavior(MissedTickBehavior::Skip);
    loop {
        let messages = select! {
            said = socket.recv() => match said {
                Some(Ok(Message::Text(text))) => match serde_json::from_str(&text) {
                    Ok(said) => session.hear(said, &done),
                    Err(_) => return,
                },
                Some(Ok(Message::Ping(_) | Message::Pong(_))) => continue,
                Some(Ok(Message::Binary(_) | Message::Close(_)) | Err(_)) | None => return,
            },
            Some(told) = dones.recv() => {
                session.acts -= 1;
                vec![json(&Told::Done(told))]
            }
            _ = frames.tick() => session.news(),
        };
        for message in messages {
            match timeout(PATIENCE, socket.send(message)).await {
                Ok(Ok(())) => {}
                _ => return,
            }
        }
        if session.is_over {
            drop(untold.take());
        }
    }
}

impl Session {
    /// Takes in what the page says; returns what is to be told at once.
    fn hear(&mut self, said: Said, done: &mpsc::UnboundedSender<wire::Done>) -> Vec<Message> {
        match said {
            Said::Drawn => self.undrawn = self.undrawn.saturating_sub(1),
            Said::Show { cells, global, edges } => {
                self.shown = Shown { cells, global, edges };
                // What is shown now is to be drawn anew, also while the run is held.
                self.frame = None;
            }
            Said::Select { robot } => (self.robot, self.told_robot) = (robot, None),
            Said::Act { id, .. } if self.acts == ACTS_MAX => {
                let refused = Err(format!("{ACTS_MAX} acts wait already"));
                return vec![json(&Told::Done(answer(id, refused)))];
            }
            Said::Act { id, act } => {
                self.acts += 1;
                let (source, done) = (Arc::clone(&self.source), done.clone());
                tokio::task::spawn_blocking(move || {
                    // The page may have gone meanwhile.
                    let _ = done.send(answer(id, source.act(act)));
                });
            }
        }
        Vec::new()
    }

    /// All that is new since it was told last.
    fn news(&mut self) -> Vec<Message> {
        let mut messages = Vec::new();
        let source = Arc::clone(&self.source);
        let hub = source.hub();
        self.tell_changes(&hub.swarm(), &mut messages);
        if self.undrawn < UNDRAWN_MAX
            && let Some((id, bytes)) = hub.frame(self.shown, self.frame)
        {
            self.frame = Some(id);
            self.undrawn += 1;
            messages.push(Message::Binary(bytes));
        }
        self.tell_robot(&hub.swarm(), &mut messages);
        messages
    }

    fn tell_changes(&mut self, swarm: &Swarm, messages: &mut Vec<Message>) {
        let before = self.versions.replace(swarm.versions);
        match before {
            None => messages.push(json(&tell::hello(swarm))),
            Some(before) => {
                if before.field != swarm.versions.field {
                    messages.push(json(&Told::Field { field: tell::field(&swarm.field) }));
                }
                if before.faults != swarm.versions.faults {
                    messages.push(json(&Told::Faults { faults: tell::faults(swarm) }));
                }
            }
        }
        let replace = before.is_none_or(|before| before.series != swarm.versions.series);
        if replace {
            (self.points, self.events) = (0, self.events.min(swarm.events.len()));
        }
        if replace || swarm.series.len() > self.points {
            messages.push(json(&Told::Series { points: &swarm.series[self.points..], replace }));
            self.points = swarm.series.len();
        }
        if swarm.events.len() > self.events {
            messages.push(json(&Told::Events { events: &swarm.events[self.events..] }));
            self.events = swarm.events.len();
        }
        let ends = swarm.is_over && !self.is_over;
        self.is_over = swarm.is_over;
        if due(&mut self.told_state, STATE) || ends {
            messages.push(json(&tell::state(swarm)));
        }
        if due(&mut self.told_agents, AGENTS) {
            messages.push(json(&tell::agents(swarm, &tell::names(swarm))));
        }
    }

    fn tell_robot(&mut self, swarm: &Swarm, messages: &mut Vec<Message>) {
        let Some(robot) = self.robot.filter(|_| due(&mut self.told_robot, ROBOT)) else { return };
        let names = tell::names(swarm);
        if let Some(robot) = inspect::robot(swarm, &names, robot) {
            messages.push(json(&Told::Robot(Box::new(robot))));
        }
    }
}

/// Whether it is time again.
fn due(last: &mut Option<Instant>, every: Duration) -> bool {
    let now = Instant::now();
    let is_due = last.is_none_or(|last| now.saturating_duration_since(last) >= every);
    if is_due {
        *last = Some(now);
    }
    is_due
}

fn answer(id: u64, outcome: Result<Done, Refused>) -> wire::Done {
    match outcome {
        Ok(Done { tick, fault, scenario }) => {
            wire::Done { id, ok: true, tick: Some(tick), fault, text: scenario, error: None }
        }
        Err(error) => wire::Done { id, ok: false, tick: None, fault: None, text: None, error: Some(error) },
    }
}

fn json(told: &Told<'_>) -> Message {
    Message::Text(serde_json::to_string(told).expect("what is told is plain data").into())
}

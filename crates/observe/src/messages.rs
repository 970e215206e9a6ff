//! A run as messages: what a recording has, and what is told to those who watch from another process.
//!
//! ```text
//! the run's loop --NoteTaker--> Note (plain data) --another thread--> messages --> a Sink
//! ```
//!
//! In a tick, what it was is only copied. Turning that into messages is the business of the thread that writes them.

mod pose;
mod scene;

use arena::{
    fault::ledger::Line,
    frame::Pose,
    losses::{Cause, Loss},
    metrics::Metrics,
};
use engine::{Acted, Incident, RunInfo, TickView};
use protocol::{command::Answer, percept::Tick};
use recording::{
    FORMAT, Message, Topic,
    foxglove::{self, log::Level, packed_element_field::NumericType},
    lamplight, timestamp,
};
use scenario::{LampSpec, Scenario};
use squad::{Participation, RobotStatus};

use self::{
    pose::{ARENA, at, shown},
    scene::Stage,
};

/// Frame that viewers begin with.
const WORLD: &str = "world";

/// Takes messages, in order of time.
pub(crate) trait Sink {
    type Error;

    /// Takes a message of so many nanoseconds of virtual time.
    fn take(&mut self, topic: Topic, time_ns: u64, message: &impl Message) -> Result<(), Self::Error>;
}

/// How much is told of each tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Extent {
    /// Places and shapes that viewers draw, and hashes that prove.
    Plain,
    /// The same, with percepts and answers to the bit.
    Full,
    /// Percepts and answers, of which the live page is made, and neither shapes nor hashes.
    Live,
}

/// Something that happened, as it is handed to the thread that makes messages of it.
pub(crate) enum Note {
    Begin(Box<(lamplight::Run, foxglove::SceneUpdate)>),
    Tick(Box<Moment>),
    Log(u64, Level, String),
    Fault(u64, lamplight::Fault),
    Act(u64, Box<lamplight::Act>),
    Lamps(u64, Vec<LampSpec>),
    End(u64, String),
}

/// One tick. What is not told is empty.
pub(crate) struct Moment {
    time_ns: u64,
    tick: Tick,
    poses: Vec<Pose>,
    velocities: Vec<f32>,
    percepts: Option<lamplight::Percepts>,
    answers: Option<lamplight::Answers>,
    losses: Option<lamplight::Losses>,
    notes: Vec<lamplight::RobotNotes>,
    hashes: Vec<u64>,
    metrics: Option<Metrics>,
    /// Each robot's part in the run, if shapes are due.
    participations: Option<Vec<Participation>>,
}

/// Notes what happens in a run.
#[derive(Clone, Debug)]
pub(crate) struct NoteTaker {
    extent: Extent,
    step_s: f64,
    metrics_every_ticks: u64,
    scene_every_ticks: u64,
    /// Which faults have been told of.
    fired: Vec<bool>,
    /// Lamps as they were told last.
    lamps: Vec<LampSpec>,
}

impl NoteTaker {
    /// Of a run of `scenario` that has not begun.
    pub(crate) fn new(scenario: &Scenario, extent: Extent) -> Self {
        Self {
            extent,
            step_s: scenario.step_s.get(),
            metrics_every_ticks: scenario.sample_every_ticks(),
            scene_every_ticks: scenario.scene_every_ticks(),
            fired: Vec::new(),
            lamps: scenario.field.lamp.clone(),
        }
    }

    fn time_ns(&self, tick: Tick) -> u64 {
        (tick as f64 * self.step_s * 1e9).round() as u64
    }

    pub(crate) fn begun(&self, run: &RunInfo<'_>) -> Note {
        let mode = serde_json::to_value(run.mode).ok();
        let scene = Stage::of(run.scenario).fixed(&run.scenario.field.lamp, Some(timestamp(0)));
        let run = lamplight::Run {
            format: FORMAT,
            lamplight: env!("CARGO_PKG_VERSION").into(),
            scenario: run.scenario.to_toml(),
            engine: run.engine.into(),
            mode: mode.as_ref().and_then(|mode| mode.as_str()).unwrap_or_default().into(),
        };
        Note::Begin(Box::new((run, scene)))
    }

    /// Whether lost packets are told one by one.
    pub(crate) fn wants_losses(&self) -> bool {
        self.extent != Extent::Plain
    }

    /// Notes which faults have struck for the first time, and lamps that have changed.
    pub(crate) fn changed(&mut self, view: &TickView<'_>, mut tell: impl FnMut(Note)) {
        let (tick, time_ns) = (view.tick(), self.time_ns(view.tick()));
        for (fault, line) in view.ledger().enumerate() {
            if self.fired.len() == fault {
                self.fired.push(false);
            }
            if line.fired_tick.is_some() && !self.fired[fault] {
                self.fired[fault] = true;
                let Line { kind, .. } = line;
                let name = kind.name();
                tell(Note::Fault(time_ns, lamplight::Fault { tick, fault: fault as u32, kind: name.into() }));
                tell(Note::Log(time_ns, Level::Info, format!("fault {fault} ({name}) strikes")));
            }
        }
        let lamps = &view.field_spec().lamp;
        if self.lamps != *lamps {
            self.lamps.clone_from(lamps);
            tell(Note::Lamps(time_ns, lamps.clone()));
        }
    }

    pub(crate) fn ticked(&self, view: &TickView<'_>) -> Note {
        let velocity = |answer: &Option<Answer>| match answer {
            Some(answer) => [answer.command.velocity.0.x as f32, answer.command.velocity.0.y as f32],
            None => [f32::NAN; 2],
        };
        let (tick, is_live) = (view.tick(), self.extent == Extent::Live);
        let percepts = view.percepts().filter(|_| self.extent != Extent::Plain);
        let part = |robot: &RobotStatus| robot.participation;
        let shows_shapes = !is_live && view.is_due(self.scene_every_ticks);
        Note::Tick(Box::new(Moment {
            tick,
            time_ns: self.time_ns(tick),
            poses: view.poses().to_vec(),
            velocities: match is_live {
                true => Vec::new(),
                false => view.answers().iter().flat_map(velocity).collect(),
            },
            answers: percepts.map(|_| lamplight::Answers::of(tick, view.answers())),
            percepts: percepts.map(|percepts| lamplight::Percepts::of(tick, percepts)),
            losses: percepts.filter(|_| !view.losses().is_empty()).map(|_| lost(tick, view.losses())),
            notes: percepts.map_or(Vec::new(), |_| noted(view)),
            hashes: if is_live { Vec::new() } else { view.hashes() },
            metrics: view.is_due(self.metrics_every_ticks).then(|| *view.metrics()),
            participations: shows_shapes.then(|| view.robots().iter().map(part).collect()),
        }))
    }

    pub(crate) fn incident(&self, incident: &Incident) -> Note {
        Note::Log(self.time_ns(incident.tick), Level::Warning, incident.what.clone())
    }

    pub(crate) fn acted(&self, acted: &Acted<'_>) -> Note {
        let act = lamplight::Act {
            tick: acted.tick,
            what: acted.what.into(),
            scenario: acted.scenario.map(Scenario::to_toml),
        };
        Note::Act(self.time_ns(acted.tick), Box::new(act))
    }

    pub(crate) fn ended(&self, tick: Tick, summary: String) -> Note {
        Note::End(self.time_ns(tick), summary)
    }
}

/// Makes messages of notes.
pub(crate) struct Messages {
    stage: Stage,
    latest_ns: u64,
}

impl Messages {
    pub(crate) fn of(scenario: &Scenario) -> Self {
        Self { stage: Stage::of(scenario), latest_ns: 0 }
    }

    /// Gives `sink` the messages of a note.
    ///
    /// # Errors
    /// If it does not take them.
    pub(crate) fn tell<S: Sink>(&mut self, sink: &mut S, note: &Note) -> Result<(), S::Error> {
        match note {
            Note::Begin(begun) => {
                let (run, scene) = &**begun;
                sink.take(Topic::Run, self.in_order(0), run)?;
                let frame = foxglove::FrameTransform {
                    timestamp: Some(timestamp(0)),
                    parent_frame_id: WORLD.into(),
                    child_frame_id: ARENA.into(),
                    translation: Some(foxglove::Vector3::default()),
                    rotation: Some(foxglove::Quaternion { w: 1.0, ..Default::default() }),
                };
                sink.take(Topic::Frame, 0, &frame)?;
                sink.take(Topic::Scene, 0, scene)
            }
            Note::Tick(moment) => self.tell_tick(sink, moment),
            Note::Log(time_ns, level, message) => {
                let time_ns = self.in_order(*time_ns);
                let (timestamp, message) = (Some(timestamp(time_ns)), message.clone());
                let level = (*level).into();
                sink.take(
                    Topic::Log,
                    time_ns,
                    &foxglove::Log { timestamp, level, message, ..Default::default() },
                )
            }
            Note::Lamps(time_ns, lamps) => {
                let time_ns = self.in_order(*time_ns);
                sink.take(Topic::Scene, time_ns, &self.stage.lamps(lamps, Some(timestamp(time_ns))))
            }
            Note::Fault(time_ns, fault) => sink.take(Topic::Faults, self.in_order(*time_ns), fault),
            Note::Act(time_ns, act) => sink.take(Topic::Acts, self.in_order(*time_ns), &**act),
            Note::End(time_ns, summary) => {
                let summary = summary.clone();
                sink.take(Topic::End, self.in_order(*time_ns), &lamplight::End { summary })
            }
        }
    }

    /// Incidents may become known late, and an act is told before its tick is: readers want messages in order.
    fn in_order(&mut self, time_ns: u64) -> u64 {
        self.latest_ns = self.latest_ns.max(time_ns);
        self.latest_ns
    }

    fn tell_tick<S: Sink>(&mut self, sink: &mut S, moment: &Moment) -> Result<(), S::Error> {
        let time_ns = self.in_order(moment.time_ns);
        let (tick, timestamp) = (moment.tick, Some(timestamp(time_ns)));
        let in_frame = foxglove::PosesInFrame {
            timestamp,
            frame_id: ARENA.into(),
            poses: moment.poses.iter().map(shown).collect(),
        };
        sink.take(Topic::Robots, time_ns, &in_frame)?;
        if !moment.hashes.is_empty() {
            sink.take(Topic::Points, time_ns, &points(&moment.poses, timestamp))?;
        }
        if let Some(participations) = &moment.participations {
            let scene = self.stage.moving(&moment.poses, participations, timestamp);
            sink.take(Topic::Scene, time_ns, &scene)?;
        }
        if !moment.velocities.is_empty() {
            let velocities = moment.velocities.clone();
            sink.take(Topic::Commands, time_ns, &lamplight::Commands { tick, velocities })?;
        }
        if let Some(percepts) = &moment.percepts {
            sink.take(Topic::Percepts, time_ns, percepts)?;
        }
        if let Some(answers) = &moment.answers {
            sink.take(Topic::Answers, time_ns, answers)?;
        }
        if let Some(losses) = &moment.losses {
            sink.take(Topic::Losses, time_ns, losses)?;
        }
        if !moment.notes.is_empty() {
            let robots = moment.notes.clone();
            sink.take(Topic::Notes, time_ns, &lamplight::Notes { tick, robots })?;
        }
        if let Some(metrics) = &moment.metrics {
            sink.take(Topic::Metrics, time_ns, &in_numbers(tick, metrics))?;
        }
        if !moment.hashes.is_empty() {
            let hashes = moment.hashes.clone();
            sink.take(Topic::Ticks, time_ns, &lamplight::Tick { tick, hashes })?;
        }
        Ok(())
    }
}

fn lost(tick: Tick, losses: &[Loss]) -> lamplight::Losses {
    let cause = |loss: &Loss| match loss.cause {
        Cause::Collision => 1,
        Cause::Chance => 2,
        Cause::Fault => 3,
        Cause::HalfDuplex => 4,
    };
    lamplight::Losses {
        tick,
        senders: losses.iter().map(|loss| loss.sender).collect(),
        receivers: losses.iter().map(|loss| loss.receiver).collect(),
        causes: losses.iter().map(cause).collect(),
    }
}

/// Notes of the robots that have some.
fn noted(view: &TickView<'_>) -> Vec<lamplight::RobotNotes> {
    let of = |robot| {
        let notes = view.notes(robot).filter(|notes| !notes.names().is_empty())?;
        let (names, values) = (notes.names().to_vec(), notes.values().to_vec());
        Some(lamplight::RobotNotes { robot, names, values })
    };
    (0..view.poses().len() as u32).filter_map(of).collect()
}

/// Robots as a cloud of points.
fn points(poses: &[Pose], timestamp: Option<prost_types::Timestamp>) -> foxglove::PointCloud {
    const BYTES: u32 = size_of::<f32>() as u32;
    let field = |(name, place): (&str, u32)| foxglove::PackedElementField {
        name: name.into(),
        offset: place * BYTES,
        r#type: NumericType::Float32.into(),
    };
    let place = |pose: &Pose| [pose.position.x as f32, pose.position.y as f32, 0.0];
    foxglove::PointCloud {
        timestamp,
        frame_id: ARENA.into(),
        pose: Some(at([0.0; 2])),
        point_stride: 3 * BYTES,
        fields: [("x", 0), ("y", 1), ("z", 2)].map(field).into(),
        data: poses.iter().flat_map(place).flat_map(f32::to_le_bytes).collect(),
    }
}

fn in_numbers(tick: Tick, metrics: &Metrics) -> lamplight::Metrics {
    let packets = &metrics.packets;
    lamplight::Metrics {
        tick,
        mean_error_m: metrics.mean_error_m,
        max_error_m: metrics.max_error_m,
        mean_true_error_m: metrics.mean_true_error_m,
        cost_h: metrics.cost_h,
        mean_lamp_distance_m: metrics.mean_lamp_distance_m,
        robots_alive: metrics.robots_alive,
        robots_paused: metrics.robots_paused,
        packets_sent: packets.sent,
        packets_heard: packets.heard,
        packets_collided: packets.collided,
        packets_lost: packets.lost_loss + packets.lost_fault,
        packets_half_duplex: packets.half_duplex,
        packets_lost_range: packets.lost_range,
        packets_lost_edge: packets.lost_edge,
        packets_occluded: packets.occluded,
        packets_lost_fault: packets.lost_fault,
        packets_over_bound: packets.over_bound,
        packets_delayed: packets.delayed,
    }
}

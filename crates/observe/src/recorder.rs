//! The recording of a run (`--record`): an MCAP file, which a thread of its own writes.
//!
//! Each tick hands over what it was; turning that into messages, compressing and writing is the thread's. So no tick waits
//! for the disk, unless that is so slow that [`QUEUE_TICKS`] of them wait for it: nothing is left out.

mod pose;
mod scene;

use std::{
    fs::{self, File},
    io::{self, BufWriter},
    path::{Path, PathBuf},
    sync::mpsc::{self, Receiver, RecvTimeoutError, SyncSender, TrySendError},
    thread::{self, JoinHandle},
    time::{Duration, Instant},
};

use arena::{frame::Pose, metrics::Metrics};
use engine::{Incident, Observer, ObserverError, RunInfo, TickView, summary::Summary};
use files::WriteError;
use protocol::percept::Tick;
use recording::{
    FORMAT, Topic, Writer,
    foxglove::{self, log::Level, packed_element_field::NumericType},
    lamplight, timestamp,
};
use scenario::Scenario;
use squad::{Participation, RobotStatus};

use self::{
    pose::{ARENA, at, shown},
    scene::Stage,
};

/// Name of the file in the run's folder.
pub const FILE: &str = "run.mcap";
/// Ticks that may wait for the thread; a tick beyond them waits itself.
pub const QUEUE_TICKS: usize = 256;
/// No more of a run than this is lost whatever ends the process.
const FLUSH_EVERY: Duration = Duration::from_secs(1);
/// Frame that viewers begin with.
const WORLD: &str = "world";

/// Records a run.
#[derive(Debug)]
pub struct Recorder {
    path: PathBuf,
    notes: Option<SyncSender<Note>>,
    /// How often a tick had to wait for the thread.
    waited: u64,
    writer: Option<JoinHandle<Result<(), recording::WriteError>>>,
    step_s: f64,
    metrics_every_ticks: u64,
    scene_every_ticks: u64,
    /// Which faults have been told of.
    fired: Vec<bool>,
}

/// A message to the thread.
enum Note {
    Begin(Box<(lamplight::Run, foxglove::SceneUpdate)>),
    Tick(Box<Moment>),
    Log(u64, Level, String),
    End(u64, String),
}

/// One tick.
struct Moment {
    tick: Tick,
    time_ns: u64,
    poses: Vec<Pose>,
    velocities: Vec<f32>,
    hashes: Vec<u64>,
    metrics: Option<Metrics>,
    /// Each robot's part in the run, if shapes are due.
    participations: Option<Vec<Participation>>,
}

impl Recorder {
    /// Begins the recording of a run of `scenario` in `folder`.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn begin(folder: &Path, scenario: &Scenario) -> Result<Self, WriteError> {
        let path = folder.join(FILE);
        let failed = |error| WriteError::new(&path, error);
        let file = File::create_new(&path).map_err(failed)?;
        let writer = Writer::new(BufWriter::new(file)).map_err(|error| {
            // The next attempt would find it in the way.
            let _ = fs::remove_file(&path);
            failed(error.into())
        })?;
        let (notes, received) = mpsc::sync_channel(QUEUE_TICKS);
        let stage = Stage::of(scenario);
        let writer = thread::spawn(move || write(writer, &received, stage));
        Ok(Self {
            path,
            notes: Some(notes),
            waited: 0,
            writer: Some(writer),
            step_s: scenario.step_s.get(),
            metrics_every_ticks: scenario.sample_every_ticks(),
            scene_every_ticks: scenario.scene_every_ticks(),
            fired: vec![false; scenario.fault.len()],
        })
    }

    fn time_ns(&self, tick: Tick) -> u64 {
        (tick as f64 * self.step_s * 1e9).round() as u64
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
        let mode = serde_json::to_value(run.mode).ok();
        let scene = Stage::of(run.scenario).fixed(run.scenario, Some(timestamp(0)));
        let run = lamplight::Run {
            format: FORMAT,
            lamplight: env!("CARGO_PKG_VERSION").into(),
            scenario: run.scenario.to_toml(),
            engine: run.engine.into(),
            mode: mode.as_ref().and_then(|mode| mode.as_str()).unwrap_or_default().into(),
        };
        self.tell(Note::Begin(Box::new((run, scene))))
    }

    fn ticked(&mut self, view: &TickView<'_>) -> Result<(), ObserverError> {
        let (tick, time_ns) = (view.tick(), self.time_ns(view.tick()));
        let mut fired = Vec::new();
        for ((index, line), told) in view.ledger().enumerate().zip(&mut self.fired) {
            if line.fired_tick.is_some() && !*told {
                *told = true;
                fired.push(format!("fault {index} ({}) strikes", line.kind.name()));
            }
        }
        for what in fired {
            self.tell(Note::Log(time_ns, Level::Info, what))?;
        }
        let velocity = |answer: &Option<protocol::command::Answer>| match answer {
            Some(answer) => [answer.command.velocity.0.x as f32, answer.command.velocity.0.y as f32],
            None => [f32::NAN; 2],
        };
        self.tell(Note::Tick(Box::new(Moment {
            tick,
            time_ns,
            poses: view.poses().to_vec(),
            velocities: view.answers().iter().flat_map(velocity).collect(),
            hashes: view.hashes(),
            metrics: view.is_due(self.metrics_every_ticks).then(|| *view.metrics()),
            participations: view
                .is_due(self.scene_every_ticks)
                .then(|| view.robots().iter().map(|robot: &RobotStatus| robot.participation).collect()),
        })))
    }

    fn incident(&mut self, incident: &Incident) {
        let note = Note::Log(self.time_ns(incident.tick), Level::Warning, incident.what.clone());
        // That the thread has ended is told with the next tick.
        let _ = self.notes.as_ref().map(|notes| notes.send(note));
    }

    fn finished(&mut self, end: &TickView<'_>, summary: &Summary) -> Result<(), ObserverError> {
        let note = Note::End(self.time_ns(end.tick()), summary.json());
        self.tell(note)?;
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
    mut file: Writer<BufWriter<File>>,
    notes: &Receiver<Note>,
    stage: Stage,
) -> Result<(), recording::WriteError> {
    let (mut is_flushed, mut flushed, mut latest_ns) = (true, Instant::now(), 0);
    loop {
        let left = FLUSH_EVERY.saturating_sub(flushed.elapsed());
        match notes.recv_timeout(left) {
            Ok(note) => {
                if is_flushed {
                    (is_flushed, flushed) = (false, Instant::now());
                }
                write_note(&mut file, note, stage, &mut latest_ns)?;
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

fn write_note(
    file: &mut Writer<BufWriter<File>>,
    note: Note,
    stage: Stage,
    latest_ns: &mut u64,
) -> Result<(), recording::WriteError> {
    // Incidents may become known late, and readers want messages in order.
    let mut in_order = |time_ns: u64| {
        *latest_ns = (*latest_ns).max(time_ns);
        *latest_ns
    };
    match note {
        Note::Begin(begun) => {
            let (run, scene) = *begun;
            file.write(Topic::Run, in_order(0), &run)?;
            let frame = foxglove::FrameTransform {
                timestamp: Some(timestamp(0)),
                parent_frame_id: WORLD.into(),
                child_frame_id: ARENA.into(),
                translation: Some(foxglove::Vector3::default()),
                rotation: Some(foxglove::Quaternion { w: 1.0, ..Default::default() }),
            };
            file.write(Topic::Frame, 0, &frame)?;
            file.write(Topic::Scene, 0, &scene)
        }
        Note::Tick(moment) => write_tick(file, in_order(moment.time_ns), *moment, stage),
        Note::Log(time_ns, level, message) => {
            let time_ns = in_order(time_ns);
            let timestamp = Some(timestamp(time_ns));
            let log = foxglove::Log { timestamp, level: level.into(), message, ..Default::default() };
            file.write(Topic::Log, time_ns, &log)
        }
        Note::End(time_ns, summary) => file.write(Topic::End, in_order(time_ns), &lamplight::End { summary }),
    }
}

fn write_tick(
    file: &mut Writer<BufWriter<File>>,
    time_ns: u64,
    moment: Moment,
    stage: Stage,
) -> Result<(), recording::WriteError> {
    let Moment { tick, poses, velocities, hashes, metrics, participations, .. } = moment;
    let timestamp = Some(timestamp(time_ns));
    let in_frame = foxglove::PosesInFrame {
        timestamp,
        frame_id: ARENA.into(),
        poses: poses.iter().map(shown).collect(),
    };
    file.write(Topic::Robots, time_ns, &in_frame)?;
    file.write(Topic::Points, time_ns, &points(&poses, timestamp))?;
    if let Some(participations) = participations {
        file.write(Topic::Scene, time_ns, &stage.moving(&poses, &participations, timestamp))?;
    }
    file.write(Topic::Commands, time_ns, &lamplight::Commands { tick, velocities })?;
    if let Some(metrics) = metrics {
        file.write(Topic::Metrics, time_ns, &in_numbers(tick, &metrics))?;
    }
    file.write(Topic::Ticks, time_ns, &lamplight::Tick { tick, hashes })
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
    }
}

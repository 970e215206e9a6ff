//! The swarm as far as it is known, from the messages of its run.

use std::{
    collections::{BTreeMap, VecDeque},
    time::Instant,
};

use arena::metrics::Partition;
use coverage::CoverageController;
use observe::live::Snapshot;
use protocol::{
    command::Answer,
    controller::Controller,
    percept::{Percept, Tick},
    robot_id::RobotId,
};
use recording::{Entry, ReadError, Topic, foxglove, lamplight};
use scenario::{FieldSpec, Scenario};
use squad::Participation;

use crate::{
    picture::Pictures,
    wire::{Event, EventKind, Point},
};

/// Most points of a plot; more are thinned out.
pub(crate) const POINTS_MAX: usize = 4000;

/// Cycles of a robot that are kept for its histogram.
const CYCLES_MAX: usize = 256;

/// Facts of a run that do not change.
#[derive(Clone, Debug)]
pub struct About {
    /// Name of the run, or of the recording.
    pub run: String,
    /// `processes` or `in-process`.
    pub engine: String,
    /// `lockstep` or `realtime`.
    pub mode: String,
    /// Whether it is a recording.
    pub is_recording: bool,
}

/// A run as far as it is known.
pub(crate) struct Swarm {
    pub(crate) about: About,
    /// With what acts have made of its fault plan.
    pub(crate) scenario: Scenario,
    /// Without that.
    begun_as: Scenario,
    /// Its field by now.
    pub(crate) field: FieldSpec,
    /// Counts what changes the field, and what changes the plan or its ledger.
    pub(crate) versions: Versions,
    pub(crate) tick: Tick,
    pub(crate) time_s: f64,
    /// Counts places that robots were told at.
    pub(crate) number: u64,
    /// x, y (m) and heading (rad) of each robot.
    pub(crate) poses: Vec<[f64; 3]>,
    /// Last percepts; empty if none are known.
    pub(crate) percepts: Vec<Percept>,
    pub(crate) answers: Vec<Option<Answer>>,
    /// Sender, receiver and cause of packets that were not heard, in the neighbor cycle before.
    pub(crate) losses: Vec<(u32, u32, u8)>,
    pub(crate) notes: BTreeMap<u32, Vec<(String, f64)>>,
    /// Robots that give no commands, where only that is known.
    is_silent: Vec<bool>,
    /// Controllers of the paper, which hear what the robots hear.
    minds: Vec<Option<CoverageController>>,
    pub(crate) lives: Vec<RobotId>,
    pictures: Computed,
    /// In the order of time.
    pub(crate) series: Vec<Point>,
    pub(crate) events: Vec<Event>,
    /// Events up to then are known from before the recording was rewound.
    told_until_s: Option<f64>,
    /// When each fault struck first.
    pub(crate) struck: BTreeMap<u32, Tick>,
    pub(crate) metrics: Option<lamplight::Metrics>,
    pub(crate) snapshot: Option<Snapshot>,
    /// The last cycles of each robot that were seen, microseconds.
    pub(crate) cycles_us: Vec<VecDeque<f64>>,
    /// Shares of a processor, by robot.
    pub(crate) cpu: BTreeMap<u32, f64>,
    /// `summary.json`, once the run is over.
    pub(crate) summary: Option<String>,
    pub(crate) is_over: bool,
    pub(crate) is_held: bool,
    pub(crate) speed: Option<f64>,
}

/// Versions of what changes seldom.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Versions {
    pub(crate) field: u64,
    pub(crate) faults: u64,
    /// The series begins anew.
    pub(crate) series: u64,
}

/// Cells are computed so seldom that it takes a part of the time in so many.
const SHARE: u32 = 20;

/// Which frame: places of one number, and cells of the same or one before.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct FrameId {
    number: u64,
    cells: u64,
}

/// Cells, of which number they are, and when they may be computed again.
#[derive(Default)]
struct Computed {
    cells: Pictures,
    of: u64,
    next: Option<Instant>,
}

impl Computed {
    fn are_due(&self) -> bool {
        self.next.is_none_or(|next| next <= Instant::now())
    }
}

impl Swarm {
    pub(crate) fn new(about: About, scenario: Scenario) -> Self {
        let robots = scenario.robot_count();
        let mind = |index| {
            let setup = scenario.coverage_setup(index)?;
            Some(CoverageController::new(RobotId::first(index), setup))
        };
        Self {
            about,
            field: scenario.field.clone(),
            versions: Versions::default(),
            tick: 0,
            time_s: 0.0,
            number: 0,
            poses: Vec::new(),
            percepts: Vec::new(),
            answers: Vec::new(),
            losses: Vec::new(),
            notes: BTreeMap::new(),
            is_silent: vec![false; robots as usize],
            minds: (0..robots).map(mind).collect(),
            lives: (0..robots).map(RobotId::first).collect(),
            pictures: Computed::default(),
            series: Vec::new(),
            events: Vec::new(),
            told_until_s: None,
            struck: BTreeMap::new(),
            metrics: None,
            snapshot: None,
            cycles_us: vec![VecDeque::new(); robots as usize],
            cpu: BTreeMap::new(),
            summary: None,
            is_over: false,
            is_held: false,
            speed: None,
            begun_as: scenario.clone(),
            scenario,
        }
    }

    /// Takes in a message.
    ///
    /// # Errors
    /// If it does not decode.
    pub(crate) fn apply(&mut self, entry: &Entry) -> Result<(), ReadError> {
        let time_s = entry.time_ns as f64 / 1e9;
        match entry.topic {
            Topic::Robots => {
                let told: foxglove::PosesInFrame = entry.message()?;
                self.poses = told.poses.iter().map(place).collect();
                self.number += 1;
                self.time_s = time_s;
                self.tick = self.scenario.tick_at(time_s);
                self.change_field();
            }
            Topic::Percepts => {
                let told: lamplight::Percepts = entry.message()?;
                // Told next, if there are some.
                self.losses.clear();
                if told.read(&mut self.percepts).is_ok() {
                    self.hear();
                }
            }
            Topic::Answers => {
                let told: lamplight::Answers = entry.message()?;
                if let Ok(answers) = told.read() {
                    self.answers = answers;
                    self.meet_new_lives();
                }
            }
            Topic::Losses => {
                let told: lamplight::Losses = entry.message()?;
                let links = told.senders.into_iter().zip(told.receivers);
                self.losses = links.zip(told.causes).map(|((from, to), cause)| (from, to, cause)).collect();
            }
            Topic::Notes => {
                let told: lamplight::Notes = entry.message()?;
                self.notes = told
                    .robots
                    .into_iter()
                    .map(|it| (it.robot, it.names.into_iter().zip(it.values).collect()))
                    .collect();
            }
            Topic::Commands => {
                let told: lamplight::Commands = entry.message()?;
                self.is_silent = told.velocities.chunks(2).map(|it| it[0].is_nan()).collect();
            }
            Topic::Metrics => {
                let told: lamplight::Metrics = entry.message()?;
                self.add_point(Point {
                    time_s,
                    mean_error_m: told.mean_error_m,
                    cost_h: told.cost_h,
                    alive: told.robots_alive,
                });
                self.metrics = Some(told);
            }
            Topic::Log => {
                let told: foxglove::Log = entry.message()?;
                let kind = match told.level() {
                    foxglove::log::Level::Info => EventKind::Fault,
                    _ => EventKind::Incident,
                };
                self.add_event(time_s, kind, told.message);
            }
            Topic::Faults => {
                let told: lamplight::Fault = entry.message()?;
                self.struck.insert(told.fault, told.tick);
                self.versions.faults += 1;
            }
            Topic::Acts => {
                let told: lamplight::Act = entry.message()?;
                self.add_event(time_s, EventKind::Act, told.what);
                let changed = told.scenario.map(|text| Scenario::parse(&self.scenario.name, &text, &[]));
                if let Some(Ok(scenario)) = changed {
                    self.scenario = scenario;
                    self.versions.faults += 1;
                }
            }
            Topic::End => {
                let told: lamplight::End = entry.message()?;
                self.add_event(time_s, EventKind::End, "the run is over".into());
                (self.summary, self.is_over) = (Some(told.summary), true);
            }
            Topic::Run | Topic::Frame | Topic::Points | Topic::Scene | Topic::Ticks => {}
        }
        Ok(())
    }

    /// Takes in how the run goes.
    pub(crate) fn look(&mut self, snapshot: Snapshot) {
        for (robot, seen) in snapshot.robots.iter().zip(&mut self.cycles_us) {
            let Some(cycles) = robot.cycles else { continue };
            if seen.back() == Some(&cycles.last_us) {
                continue;
            }
            if seen.len() == CYCLES_MAX {
                seen.pop_front();
            }
            seen.push_back(cycles.last_us);
        }
        self.snapshot = Some(snapshot);
    }

    /// Robots hear their percepts, as their controllers do.
    fn hear(&mut self) {
        for (mind, percept) in self.minds.iter_mut().zip(&self.percepts) {
            if let Some(mind) = mind {
                mind.hear(percept);
            }
        }
    }

    /// A robot that begins another life has forgotten what it heard.
    fn meet_new_lives(&mut self) {
        for (answer, (index, mind)) in self.answers.iter().zip((0..).zip(&mut self.minds)) {
            let Some(Answer { sender, .. }) = answer else { continue };
            let life = &mut self.lives[index as usize];
            if *life == *sender {
                continue;
            }
            *life = *sender;
            if let Some(setup) = self.scenario.coverage_setup(index) {
                *mind = Some(CoverageController::new(*sender, setup));
            }
        }
    }

    /// Takes in what faults of kind `field` have made of the field by now.
    fn change_field(&mut self) {
        let field = self.scenario.field_at(self.tick);
        if field != self.field {
            self.field = field;
            self.versions.field += 1;
        }
    }

    /// Begins anew: what has been told of is not told of again until there is news.
    pub(crate) fn rewind(&mut self) {
        let (about, scenario) = (self.about.clone(), self.begun_as.clone());
        let versions = Versions {
            field: self.versions.field + 1,
            faults: self.versions.faults + 1,
            series: self.versions.series + 1,
        };
        let told_until_s = self.events.last().map(|event| event.time_s);
        *self = Self {
            versions,
            number: self.number + 1,
            poses: std::mem::take(&mut self.poses),
            events: std::mem::take(&mut self.events),
            told_until_s,
            is_held: self.is_held,
            speed: self.speed,
            ..Self::new(about, scenario)
        };
    }

    fn add_point(&mut self, point: Point) {
        self.series.push(point);
        if self.series.len() > POINTS_MAX {
            let mut keep = false;
            self.series.retain(|_| {
                keep = !keep;
                keep
            });
            self.versions.series += 1;
        }
    }

    pub(crate) fn add_event(&mut self, time_s: f64, kind: EventKind, text: String) {
        if self.told_until_s.is_some_and(|until_s| time_s <= until_s) {
            return;
        }
        self.events.push(Event { time_s, tick: self.scenario.tick_at(time_s), kind, text });
    }

    /// Whether a robot takes part, as far as that is known.
    pub(crate) fn participation(&self, robot: usize) -> Participation {
        if let Some(told) = self.snapshot.as_ref().and_then(|snapshot| snapshot.robots.get(robot)) {
            return told.participation;
        }
        let is_silent = match self.answers.get(robot) {
            Some(answer) => answer.is_none(),
            None => self.is_silent.get(robot) == Some(&true),
        };
        if is_silent { Participation::Down } else { Participation::Present }
    }

    /// Which frame there is now. Where cells are shown, they are computed again, unless that would take more than its share of
    /// time: then they are some ticks old.
    pub(crate) fn frame_id(&mut self, shows_cells: bool) -> FrameId {
        if shows_cells && self.pictures.of != self.number && self.pictures.are_due() {
            let began = Instant::now();
            let cells = self.compute_pictures();
            let took = began.elapsed();
            self.pictures = Computed { cells, of: self.number, next: Some(Instant::now() + SHARE * took) };
        }
        FrameId { number: self.number, cells: if shows_cells { self.pictures.of } else { 0 } }
    }

    /// The cells that were computed last.
    pub(crate) fn pictures(&self) -> &Pictures {
        &self.pictures.cells
    }

    fn compute_pictures(&self) -> Pictures {
        let takes_part = |robot: &usize| self.participation(*robot) == Participation::Present;
        let present: Vec<usize> = (0..self.poses.len()).filter(takes_part).collect();
        let local = (0..self.poses.len()).map(|robot| {
            let (mind, percept) = (self.minds.get(robot)?.as_ref()?, self.percepts.get(robot)?);
            takes_part(&robot).then(|| mind.picture(percept))
        });
        let local: Vec<_> = local.collect();
        let sites = present.iter().map(|&robot| [self.poses[robot][0], self.poses[robot][1]].into());
        let partition = Partition::new(sites.collect(), self.scenario.arena.size_m.get());
        let mut global = vec![Vec::new(); self.poses.len()];
        for (&robot, cell) in present.iter().zip(partition.cells()) {
            global[robot] = cell.iter().map(|corner| [corner.x, corner.y]).collect();
        }
        Pictures::new(&self.poses, local, global)
    }

    /// The mind of a robot that a law of the paper moves.
    pub(crate) fn mind(&self, robot: u32) -> Option<&CoverageController> {
        self.minds.get(robot as usize)?.as_ref()
    }
}

/// x, y and heading of a pose.
fn place(pose: &foxglove::Pose) -> [f64; 3] {
    let at = pose.position.unwrap_or_default();
    let turn = pose.orientation.unwrap_or_default();
    [at.x, at.y, 2.0 * turn.z.atan2(turn.w)]
}

//! The scenario: the TOML file that defines a run, resolved, checked and explained.
//!
//! In:  the text of a file and overrides from the command line (`--set key.path=value`).
//! Out: a [`Scenario`] that every later stage can trust, or one clear line that says where and what is wrong.
//!
//! A file becomes a `document` (a TOML tree that knows where each value was written), overrides change the tree, the
//! tree becomes the tables of [`mod@file`], whose keys may be left out, each table is resolved to what its keys and their
//! defaults mean, and `check` asks what no single table can answer. Defaults are written in [`mod@file`] and nowhere else.
//! Reading the file in `load` is the only I/O of this crate.
//!
//! ```
//! use scenario::Scenario;
//!
//! let text = "duration_s = 1\nstep_s = 0.1\narena.size_m = [2, 1]\nrobots.count = 3\nchannel.range_m = 1\n\
//!             controller.gain_per_s = 1";
//! let scenario = Scenario::parse("three.toml", text, &["robots.count=4".parse()?])?;
//! assert_eq!((scenario.robot_count(), scenario.ticks()), (4, 10));
//!
//! let error = Scenario::parse("three.toml", &text.replace("gain", "gian"), &[]).unwrap_err();
//! assert!(error.to_string().starts_with("three.toml:6: "), "{error}");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#[macro_use]
mod number;
mod channel;
mod check;
mod controller;
mod document;
mod error;
mod explain;
pub mod fault;
pub mod file;
mod hex;
mod light;
mod load;
mod overrides;
mod problem;
mod process_fault;
mod robot_set;
mod robots;
mod schema;
mod sensors;
mod steps;
mod tables;
mod time_out;

use coverage::setup::{Closure, CoverageSetup};
use protocol::params::Params;
use protocol::setup::{AgentSetup, ClockSetup, Mode, Plane};
use protocol::units::{Meters, MetersPerSecond, Seconds};

pub use channel::{Access, Air, Capture, ChannelModel, ChannelSpec, Medium, Profile};
pub use check::MAX_GAIN_STEP;
pub use controller::{Controller, Gradient, LawSpec, Mind, ProgramSpec};
pub use error::{Origin, Place, ScenarioError};
pub use fault::{Fault, FaultKind};
pub use file::{
    ArenaSpec, ConvergenceSpec, FieldSpec, FuzzSpec, GaussianSpec, LampSpec, OnHang, OutputSpec,
    ProcessesSpec,
};
pub use hex::{PayloadHex, PayloadHexError};
pub use light::{LightSpec, RingSpec};
pub use load::BYTES_MAX;
pub use number::{
    DiodeCount, FaultCount, Finite, FlipCount, MAX_ROBOTS, NonNegative, PayloadBytes, Positive, Probability,
    Refused, RobotCount, SEED_MAX, Seed, Share, Xy,
};
pub use overrides::{Override, OverrideError};
pub use problem::Problem;
pub use process_fault::{ProcessAction, ProcessFault};
pub use robot_set::{Link, LinkError, RobotSet, RobotSetError};
pub use robots::{Drive, RobotsSpec};
pub use schema::schema_json;
pub use sensors::{OdometrySpec, Sensor, SensorsSpec};
pub use steps::{Rounded, Roundings, STEPS_MAX};

use document::Document;
use file::File;

/// A run of a robot swarm: the arena, the robots, what they sense, how they move and what is recorded.
///
/// Resolved: every default is filled in. An `Option` is something that a run may really be without.
#[derive(Clone, Debug, PartialEq)]
pub struct Scenario {
    /// Name of the scenario.
    pub name: String,
    /// One line about what the scenario shows.
    pub description: Option<String>,
    /// Seed of every random draw: the same seed gives the same run.
    pub seed: Seed,
    /// Length of the run in seconds of virtual time: a whole number of steps.
    pub duration_s: Positive,
    /// Length of one tick in seconds of virtual time.
    pub step_s: Positive,
    /// The arena the robots move in.
    pub arena: ArenaSpec,
    /// The robots' bodies and where they start.
    pub robots: RobotsSpec,
    /// The sensory function φ.
    pub field: FieldSpec,
    /// The light sensor of every robot.
    pub light: LightSpec,
    /// Other sensors.
    pub sensors: SensorsSpec,
    /// Controllers and their robots: each robot is in one of them.
    pub controllers: Vec<Controller>,
    /// The infrared channel: who hears whom, and how well.
    pub channel: ChannelSpec,
    /// When the swarm counts as converged.
    pub convergence: ConvergenceSpec,
    /// How the robots' processes are supervised.
    pub processes: ProcessesSpec,
    /// Recorded outputs.
    pub output: OutputSpec,
    /// The fault plan: what shall go wrong, in the order in which faults see each packet and robot.
    pub fault: Vec<Fault>,
    /// Bounds of random fault plans, for `lamplight fuzz`.
    pub fuzz: FuzzSpec,

    /// The times above that were written otherwise: they were no whole numbers of steps.
    pub roundings: Roundings,
}

impl Scenario {
    /// The scenario of a text; `source_name` (a path) names it in errors and gives its default name.
    pub fn parse(source_name: &str, text: &str, overrides: &[Override]) -> Result<Self, ScenarioError> {
        let document = Document::parse(source_name, text, overrides)?;
        let file: File = document.deserialize()?;
        let plan = (0..file.faults()).map(|index| fault::read(&document, index));
        let plan = plan.collect::<Result<Vec<_>, _>>()?;
        let controllers = file::controller::read(&document)?;
        let resolved = file.resolve(source_name, controllers, plan).and_then(|mut scenario| {
            check::check(&scenario, &|path| document.place_of_given(path).is_some())?;
            steps::settle(&mut scenario, &|path| document.place_of_given(path))?;
            Ok(scenario)
        });
        resolved.map_err(|problem| document.blame(problem))
    }

    /// Length of a neighbor cycle, seconds.
    pub fn cycle_s(&self) -> f64 {
        self.channel.cycle_s.get()
    }

    /// The neighbor cycle that tick `tick` lies in, counted from 0.
    pub fn cycle_of(&self, tick: u64) -> u64 {
        steps::whole_part(tick as f64 * self.step_s.get() / self.cycle_s())
    }

    /// Whether a neighbor cycle begins at this tick: agents then get a percept, and answer it.
    pub fn begins_cycle(&self, tick: u64) -> bool {
        tick == 0 || self.cycle_of(tick) != self.cycle_of(tick - 1)
    }

    /// The controller of a robot.
    pub fn controller_of(&self, robot: u32) -> &Controller {
        let controller = self.controllers.iter().find(|it| it.robots.contains(robot));
        controller.expect("reading has made sure that every robot has one")
    }

    /// The laws of the paper among the controllers.
    pub fn laws(&self) -> impl Iterator<Item = &LawSpec> + Clone {
        self.controllers.iter().filter_map(Controller::law)
    }

    /// Makes sure that every program can be started, and knows its path: for who starts processes.
    ///
    /// # Errors
    /// If one is missing or not executable.
    pub fn find_programs(&mut self) -> Result<(), ScenarioError> {
        self.controllers.iter_mut().try_for_each(Controller::find_program)
    }

    /// Makes sure that laws think for all robots: for who starts no processes. `instead` says what is to be done.
    ///
    /// # Errors
    /// If a program thinks for some.
    pub fn refuse_programs(&self, instead: &str) -> Result<(), ScenarioError> {
        let of_program = |it: &Controller| Some((it.clone(), it.program()?.command[0].clone()));
        match self.controllers.iter().find_map(of_program) {
            None => Ok(()),
            Some((controller, program)) => {
                let robots = &controller.robots;
                Err(controller.error(format!("robots {robots} need processes: they run {program}"), instead))
            }
        }
    }

    /// Ticks for which robots with this controller remember a neighbor that is not heard: rounded down, so that silence
    /// of as many cycles is always seen; at least 1. What a `u32` cannot hold is longer than any run.
    pub fn neighbor_timeout_ticks(&self, controller: &Controller) -> u32 {
        let cycles = controller.neighbor_timeout_cycles().get();
        let ticks = steps::whole_part(f64::from(cycles) * self.cycle_s() / self.step_s.get());
        u32::try_from(ticks).unwrap_or(u32::MAX).max(1)
    }

    /// The tick nearest to a time.
    pub fn tick_at(&self, time_s: f64) -> u64 {
        (time_s / self.step_s.get()).round() as u64
    }

    /// When a tick is, seconds.
    pub fn time_of(&self, tick: u64) -> f64 {
        steps::time_of(tick, self.step_s.get())
    }

    /// Number of ticks in the run: `duration_s` in steps.
    pub fn ticks(&self) -> u64 {
        self.whole_steps(self.duration_s)
    }

    /// Ticks between two rows of `metrics.csv`: `metrics_every_s` in steps.
    pub fn sample_every_ticks(&self) -> u64 {
        self.whole_steps(self.output.metrics_every_s)
    }

    /// Ticks between two times in `poses.csv`, if the scenario asks for one: `poses_every_s` in steps.
    pub fn poses_every_ticks(&self) -> Option<u64> {
        self.output.poses_every_s.map(|every_s| self.whole_steps(every_s))
    }

    /// Number of robots in the run, at least one.
    pub fn robot_count(&self) -> u32 {
        self.robots.count
    }

    /// The lamps, in the order of the file.
    pub fn lamps(&self) -> &[LampSpec] {
        &self.field.lamp
    }

    /// Returns what robots are granted to sense, beside the packets that they hear: each sensor that one of them has.
    pub fn granted(&self) -> Vec<Sensor> {
        let sensors = [
            (Sensor::Light, true),
            (Sensor::Bump, true),
            (Sensor::Walls, self.arena.boundary_sensing),
            (Sensor::Odometry, self.sensors.odometry.is_some()),
            (Sensor::Compass, self.sensors.compass),
            (Sensor::Position, self.sensors.position),
            (Sensor::Field, self.controllers.iter().any(Controller::senses_field)),
        ];
        sensors.into_iter().filter(|(_, granted)| *granted).map(|(sensor, _)| sensor).collect()
    }

    /// Returns the setup of an agent with this controller before its first tick: the same for all such, and silent about
    /// how many there are.
    pub fn agent_setup(&self, mode: Mode, controller: &Controller) -> AgentSetup {
        let cycle = seconds(self.channel.cycle_s);
        let clock = ClockSetup {
            drift_ppm: self.processes.clock_drift_ppm.get(),
            jitter: Seconds::new(self.processes.timer_jitter_s.get()).expect("it is a finite number"),
            seed: self.seed.get(),
        };
        AgentSetup {
            mode,
            plane: self.plane(mode),
            payload_bytes_max: self.channel.payload_bytes_max.get(),
            cycle,
            clock,
            params: self.params(controller),
            pid_namespace: None,
        }
    }

    /// Returns the parameters of a controller as its robots get them.
    pub fn params(&self, controller: &Controller) -> Params {
        match &controller.mind {
            Mind::Law(law) => {
                Params::encoded(&self.setup_of_law(law, self.neighbor_timeout_ticks(controller)))
            }
            Mind::Program(program) => Params::of_json(program.json()),
        }
    }

    /// Returns the setup of a robot's law; `None` if a program thinks for it.
    pub fn coverage_setup(&self, robot: u32) -> Option<CoverageSetup> {
        let controller = self.controller_of(robot);
        let law = controller.law()?;
        Some(self.setup_of_law(law, self.neighbor_timeout_ticks(controller)))
    }

    /// Returns the plane for messages between the arena and agents that keep time like this.
    pub fn plane(&self, mode: Mode) -> Plane {
        self.processes.plane.unwrap_or(mode.plane())
    }

    /// The scenario as a file, with every default written out; it parses to an equal scenario.
    pub fn to_toml(&self) -> String {
        toml::to_string(&File::from(self.clone()))
            .expect("a scenario is tables of numbers and names, all of which TOML has")
    }

    fn whole_steps(&self, time_s: Positive) -> u64 {
        ((time_s.get() / self.step_s.get()).round() as u64).max(1)
    }

    fn setup_of_law(&self, spec: &LawSpec, neighbor_timeout_ticks: u32) -> CoverageSetup {
        CoverageSetup {
            law: spec.law,
            gain_per_s: spec.gain_per_s.get(),
            speed_cap: self.robots.speed_limit_m_per_s.map(meters_per_second),
            gradient: spec.gradient.into(),
            closure: Closure {
                triangle_base: meters(spec.triangle_base_m),
                triangle_height: meters(spec.triangle_height_m),
                close_distance: meters(spec.close_distance_m),
                cap: spec.cell_cap_m.map(meters),
            },
            neighbor_timeout_ticks,
        }
    }
}

fn meters(value: Positive) -> Meters {
    Meters::new(value.get()).expect("a Positive is finite")
}

fn seconds(value: Positive) -> Seconds {
    Seconds::new(value.get()).expect("a Positive is finite")
}

fn meters_per_second(value: Positive) -> MetersPerSecond {
    MetersPerSecond::new(value.get()).expect("a Positive is finite")
}

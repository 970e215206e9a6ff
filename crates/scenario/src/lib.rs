//! The scenario: the TOML file that defines a run, resolved, checked and explained.
//!
//! In:  the text of a file and overrides from the command line (`--set key.path=value`).
//! Out: a [`Scenario`] that every later stage can trust, or one clear line that says where and what is wrong.
//!
//! A file becomes a `document` (a TOML tree that knows where each value was written), overrides change
//! the tree, the tree becomes `tables` of checked numbers, and `check` asks what no single value can
//! answer. Reading the file in `load` is the only I/O of this crate.

#[macro_use]
mod number;
mod channel;
mod check;
mod document;
mod error;
mod explain;
mod fault_check;
mod faults;
mod hex;
mod light;
mod load;
mod overrides;
mod problem;
mod robot_set;
mod schema;
mod steps;
mod tables;
mod time_out;

use std::{num::NonZeroU32, path::Path};

use protocol::setup::{AgentSetup, ClockSetup, Closure, ControllerSetup, GradientMode, Law, Mode, Plane};
use protocol::units::{Meters, MetersPerSecond, Seconds};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use channel::{Access, Capture, ChannelModel, ChannelSpec, Profile};
pub use check::MAX_GAIN_STEP;
pub use error::{Place, ScenarioError};
pub use faults::{Direction, Disc, FaultKind, FaultSpec, FuzzSpec, Origin, Pick};
pub use hex::{PayloadHex, PayloadHexError};
pub use light::{LightSensor, LightSpec};
pub use load::BYTES_MAX;
pub use number::{
    DiodeCount, FaultCount, Finite, FlipCount, MAX_ROBOTS, NonNegative, PayloadBytes, Positive, Probability,
    Refused, RobotCount, SEED_MAX, Seed, Share, Xy,
};
pub use overrides::{Override, OverrideError};
pub use robot_set::{Link, LinkError, RobotSet, RobotSetError};
pub use schema::schema_json;
pub use steps::{Rounded, Roundings, STEPS_MAX};
pub use tables::{
    ArenaSpec, ControllerSpec, ConvergenceSpec, Drive, FieldSpec, GaussianSpec, GradientSource, LampSpec,
    OnHang, OutputSpec, ProcessesSpec, RobotsSpec, Sensor, SensorsSpec,
};

use document::Document;

/// A run of a robot swarm: the arena, the robots, what they sense, how they move and what is recorded.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "Lamplight scenario")]
pub struct Scenario {
    /// Name of the scenario; default: the file's name without `.toml`.
    #[serde(default)]
    pub name: String,
    /// One line about what the scenario shows.
    pub description: Option<String>,
    /// Seed of every random draw: the same seed gives the same run. At most 2^53 − 1, which every reader of JSON keeps.
    #[serde(default = "first_seed")]
    pub seed: Seed,
    /// Length of the run in seconds of virtual time: a whole number of steps, or rounded to one.
    pub duration_s: Positive,
    /// Length of one tick in seconds of virtual time.
    pub step_s: Positive,
    /// The arena the robots move in.
    pub arena: ArenaSpec,
    /// The robots' bodies and where they start.
    pub robots: RobotsSpec,
    /// The sensory function φ.
    #[serde(default)]
    pub field: FieldSpec,
    /// The light sensor of every robot.
    #[serde(default)]
    pub light: LightSpec,
    /// Other sensors.
    #[serde(default)]
    pub sensors: SensorsSpec,
    /// The controller every robot runs.
    pub controller: ControllerSpec,
    /// The infrared channel: who hears whom, and how well.
    pub channel: ChannelSpec,
    /// When the swarm counts as converged.
    #[serde(default)]
    pub convergence: ConvergenceSpec,
    /// How the robots' processes are supervised.
    #[serde(default)]
    pub processes: ProcessesSpec,
    /// Recorded outputs.
    #[serde(default)]
    pub output: OutputSpec,
    /// The fault plan: what shall go wrong, in the order in which faults see each packet and robot.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub fault: Vec<FaultSpec>,
    /// Bounds of random fault plans, for `lamplight fuzz`.
    #[serde(default)]
    pub fuzz: FuzzSpec,

    /// The times above that were written otherwise: they were no whole numbers of steps.
    #[serde(skip)]
    pub roundings: Roundings,
}

impl Scenario {
    /// The scenario of a text; `source_name` (a path) names it in errors and gives its default name.
    pub fn parse(source_name: &str, text: &str, overrides: &[Override]) -> Result<Self, ScenarioError> {
        let document = Document::parse(source_name, text, overrides)?;
        let mut scenario: Self = document.deserialize()?;
        if scenario.name.is_empty() {
            scenario.name = file_stem(source_name);
        }
        check::robot_count(&scenario.robots)
            .map(|count| scenario.robots.count = Some(count))
            .and_then(|()| check::given(&scenario))
            .and_then(|()| {
                scenario = scenario.clone().filled();
                check::check(&scenario)
            })
            .and_then(|()| steps::settle(&mut scenario, |path| document.place_of_given(path)))
            .map_err(|problem| document.blame(problem))?;
        for (index, fault) in scenario.fault.iter_mut().enumerate() {
            fault.origin = Origin(Some(document.place_of(&format!("fault.{index}.kind"))));
        }
        Ok(scenario)
    }

    /// The same with every default that depends on other keys written out.
    fn filled(mut self) -> Self {
        self.channel = self.channel.filled(self.step_s);
        self.light = self.light.filled();
        self.sensors.odometry.get_or_insert(self.robots.drive == Drive::Differential);
        let cycles = time_out::default_cycles(&self.channel, &self.fault);
        self.controller.neighbor_timeout_cycles.get_or_insert(cycles);
        self
    }

    /// Length of a neighbor cycle, seconds.
    pub fn cycle_s(&self) -> f64 {
        self.channel.cycle_s.unwrap_or(self.step_s).get()
    }

    /// The neighbor cycle that tick `tick` lies in, counted from 0.
    pub fn cycle_of(&self, tick: u64) -> u64 {
        steps::whole_part(tick as f64 * self.step_s.get() / self.cycle_s())
    }

    /// Whether a neighbor cycle begins at this tick: agents then get a percept, and answer it.
    pub fn begins_cycle(&self, tick: u64) -> bool {
        tick == 0 || self.cycle_of(tick) != self.cycle_of(tick - 1)
    }

    /// Ticks for which a neighbor that is not heard is remembered: rounded down, so that silence of as many cycles is
    /// always seen; at least 1. What a `u32` cannot hold is longer than any run.
    pub fn neighbor_timeout_ticks(&self) -> u32 {
        let cycles = self.controller.neighbor_timeout_cycles.map_or(1, NonZeroU32::get);
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

    /// Number of robots in the run; parsing made sure there is one.
    pub fn robot_count(&self) -> u32 {
        self.robots.count.map_or(0, RobotCount::get)
    }

    /// Returns what robots are granted to sense, beside the packets that they hear.
    pub fn granted(&self) -> Vec<Sensor> {
        let sensors = [
            (Sensor::Light, true),
            (Sensor::Bump, true),
            (Sensor::Walls, self.arena.boundary_sensing),
            (Sensor::Odometry, self.sensors.odometry == Some(true)),
            (Sensor::Compass, self.sensors.compass),
            (Sensor::Position, self.sensors.position),
            (Sensor::Field, self.controller.law == Law::Exact),
        ];
        sensors.into_iter().filter(|(_, granted)| *granted).map(|(sensor, _)| sensor).collect()
    }

    /// The lamps, in the order of the file.
    pub fn lamps(&self) -> &[LampSpec] {
        &self.field.lamp
    }

    /// Returns the setup of each agent before its first tick: the same for all, and silent about how many there are.
    pub fn agent_setup(&self, mode: Mode) -> AgentSetup {
        let cycle = seconds(self.channel.cycle_s.unwrap_or(self.step_s));
        let clock = ClockSetup {
            drift_ppm: self.processes.clock_drift_ppm.get(),
            jitter: Seconds::new(self.processes.timer_jitter_s.get()).expect("it is a finite number"),
            seed: self.seed.get(),
        };
        let (plane, controller) = (self.plane(mode), self.controller_setup());
        let payload_bytes_max = self.channel.payload_bytes_max.get();
        AgentSetup { mode, plane, payload_bytes_max, cycle, clock, controller, pid_namespace: None }
    }

    /// Returns the plane for messages between the arena and agents that keep time like this.
    pub fn plane(&self, mode: Mode) -> Plane {
        self.processes.plane.unwrap_or(mode.plane())
    }

    /// The scenario as a file, with every default written out; it parses to an equal scenario.
    pub fn to_toml(&self) -> String {
        toml::to_string(self).expect("a scenario is tables of numbers and names, all of which TOML has")
    }

    fn whole_steps(&self, time_s: Positive) -> u64 {
        ((time_s.get() / self.step_s.get()).round() as u64).max(1)
    }

    fn controller_setup(&self) -> ControllerSetup {
        let spec = &self.controller;
        ControllerSetup {
            law: spec.law,
            gain_per_s: spec.gain_per_s.get(),
            speed_cap: self.robots.speed_limit_m_per_s.map(meters_per_second),
            gradient: match (spec.gradient, spec.gradient_magnitude_per_m) {
                (GradientSource::Fixed, Some(magnitude_per_m)) => GradientMode::Fixed(magnitude_per_m.get()),
                _ => GradientMode::Measured,
            },
            closure: Closure {
                triangle_base: meters(spec.triangle_base_m),
                triangle_height: meters(spec.triangle_height_m),
                close_distance: meters(spec.close_distance_m),
                cap: spec.cell_cap_m.map(meters),
            },
            neighbor_timeout_ticks: self.neighbor_timeout_ticks(),
        }
    }
}

fn first_seed() -> Seed {
    constant!(Seed, 1)
}

fn file_stem(path: &str) -> String {
    Path::new(path).file_stem().unwrap_or_default().to_string_lossy().into_owned()
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

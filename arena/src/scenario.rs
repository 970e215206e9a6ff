//! The scenario: the TOML file that defines a run, resolved, checked and explained.
//!
//! In:  the text of a file and overrides from the command line (`--set key.path=value`).
//! Out: a [`Scenario`] that every later stage can trust, or one clear line that says where and what is wrong.
//!
//! A file becomes a `document` (a TOML tree that knows where each value was written), overrides change
//! the tree, the tree becomes `tables` of checked numbers, and `check` asks what no single value can
//! answer. Reading the file in `load` is the only I/O of this crate.

mod check;
mod document;
mod error;
mod explain;
mod load;
mod number;
mod overrides;
mod schema;
mod tables;

use std::path::Path;

use protocol::setup::{AgentSetup, Closure, ControllerSetup, GradientMode, Mode};
use protocol::units::{Meters, MetersPerSecond, Seconds};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use check::MAX_GAIN_STEP;
pub use error::{Place, ScenarioError};
pub use number::{Finite, MAX_ROBOTS, NonNegative, Positive, Refused, RobotCount, Xy};
pub use overrides::{Override, OverrideError};
pub use schema::schema_json;
pub use tables::{
    ArenaSpec, ChannelModel, ChannelSpec, ControllerSpec, ConvergenceSpec, Drive, FieldSpec, GaussianSpec,
    GradientSource, LampSpec, OnHang, OutputSpec, ProcessesSpec, RobotsSpec,
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
    /// What the scenario shows, in one line.
    pub description: Option<String>,
    /// Seed of every random draw: the same seed gives the same run.
    #[serde(default = "first_seed")]
    pub seed: u64,
    /// Length of the run in seconds of virtual time.
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
    /// The controller every robot runs.
    pub controller: ControllerSpec,
    /// Who hears whom.
    pub channel: ChannelSpec,
    /// When the swarm counts as converged.
    #[serde(default)]
    pub convergence: ConvergenceSpec,
    /// How the robots' processes are supervised.
    #[serde(default)]
    pub processes: ProcessesSpec,
    /// What is recorded.
    #[serde(default)]
    pub output: OutputSpec,
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
            .and_then(|()| check::check(&scenario))
            .map_err(|problem| document.blame(problem))?;
        Ok(scenario)
    }

    /// Number of ticks in the run: `duration_s` over `step_s`, rounded, at least 1.
    pub fn ticks(&self) -> u64 {
        self.whole_steps(self.duration_s)
    }

    /// Ticks between two rows of `metrics.csv`: `metrics_every_s` over `step_s`, rounded, at least 1.
    pub fn sample_every_ticks(&self) -> u64 {
        self.whole_steps(self.output.metrics_every_s)
    }

    /// Number of robots in the run; parsing made sure there is one.
    pub fn robot_count(&self) -> u32 {
        self.robots.count.map_or(0, RobotCount::get)
    }

    /// The lamps, in the order of the file.
    pub fn lamps(&self) -> &[LampSpec] {
        &self.field.lamp
    }

    /// What each robot is told before its first tick: the same for all, and silent about how many there are.
    pub fn agent_setup(&self, mode: Mode) -> AgentSetup {
        AgentSetup { mode, step: seconds(self.step_s), controller: self.controller_setup() }
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
            // Every robot transmits once a tick, so a neighbor cycle is a tick.
            neighbor_timeout_ticks: spec.neighbor_timeout_cycles.get(),
        }
    }
}

fn first_seed() -> u64 {
    1
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

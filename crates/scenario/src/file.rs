//! A scenario file as it is written: its tables, one module each, and the defaults of keys that are left out.
//!
//! In:  the TOML tree of a file. The doc comments here are the schema's descriptions.
//! Out: a [`Scenario`], or the first [`Problem`] of one table. A table whose keys all stand for themselves is the same
//!      type in both; one with keys that depend on others (`…Keys`) resolves to another.

mod arena;
mod channel;
mod choice;
pub(crate) mod controller;
mod convergence;
mod field;
mod fuzz;
mod light;
mod output;
mod processes;
mod robots;
mod sensors;

use std::borrow::Cow;
use std::path::Path;

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::de::IgnoredAny;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::fault::Fault;
use crate::number::{Positive, Seed};
use crate::problem::Problem;
use crate::steps::Roundings;
use crate::{Scenario, time_out};

pub use arena::ArenaSpec;
pub use channel::{AccessKey, ChannelKeys, ModelKey};
pub use convergence::ConvergenceSpec;
pub use field::{FieldSpec, GaussianSpec, LampSpec};
pub use fuzz::FuzzSpec;
pub use output::OutputSpec;
pub use processes::{OnHang, ProcessesSpec};

use controller::ControllerTables;
use light::LightKeys;
use robots::RobotsKeys;
use sensors::SensorsKeys;

/// A run of a robot swarm: the arena, the robots, what they sense, how they move and what is recorded.
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "Lamplight scenario")]
pub(crate) struct File {
    /// Name of the scenario; default: the file's name without `.toml`.
    #[serde(default)]
    name: String,
    /// One line about what the scenario shows.
    description: Option<String>,
    /// Seed of every random draw: the same seed gives the same run. At most 2^53 − 1, which every reader of JSON keeps.
    #[serde(default = "first_seed")]
    seed: Seed,
    /// Length of the run in seconds of virtual time: a whole number of steps, or rounded to one.
    duration_s: Positive,
    /// Length of one tick in seconds of virtual time.
    step_s: Positive,
    /// The arena the robots move in.
    arena: ArenaSpec,
    /// The robots' bodies and where they start.
    robots: RobotsKeys,
    /// The sensory function φ.
    #[serde(default)]
    field: FieldSpec,
    /// The light sensor of every robot.
    #[serde(default)]
    light: LightKeys,
    /// Other sensors.
    #[serde(default)]
    sensors: SensorsKeys,
    /// Controllers of the robots: `[controller]` for all, or a `[[controller]]` for some each.
    controller: Deferred<ControllerTables>,
    /// The infrared channel: who hears whom, and how well.
    channel: ChannelKeys,
    /// When the swarm counts as converged.
    #[serde(default)]
    convergence: ConvergenceSpec,
    /// How the robots' processes are supervised.
    #[serde(default)]
    processes: ProcessesSpec,
    /// Recorded outputs.
    #[serde(default)]
    output: OutputSpec,
    /// The fault plan: what shall go wrong, in the order in which faults see each packet and robot.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    fault: Vec<Deferred<Fault>>,
    /// Bounds of random fault plans, for `lamplight fuzz`.
    #[serde(default)]
    fuzz: FuzzSpec,
}

impl File {
    /// Number of its faults.
    pub(crate) fn faults(&self) -> usize {
        self.fault.len()
    }

    /// Resolves the file named `source_name`, with its controllers and its fault plan.
    pub(crate) fn resolve(
        self,
        source_name: &str,
        controllers: Vec<controller::Entry>,
        fault: Vec<Fault>,
    ) -> Result<Scenario, Problem> {
        let robots = self.robots.resolve()?;
        let channel = self.channel.resolve(self.step_s)?;
        let sensors = self.sensors.resolve(robots.drive)?;
        let light = self.light.resolve()?;
        let timeout_cycles = time_out::default_cycles(&channel, &fault);
        let controllers = controller::resolve(controllers, source_name, robots.count, timeout_cycles)?;
        Ok(Scenario {
            name: if self.name.is_empty() { file_stem(source_name) } else { self.name },
            description: self.description,
            seed: self.seed,
            duration_s: self.duration_s,
            step_s: self.step_s,
            arena: self.arena,
            robots,
            field: self.field,
            light,
            sensors,
            controllers,
            channel,
            convergence: self.convergence,
            processes: self.processes,
            output: self.output,
            fault,
            fuzz: self.fuzz,
            roundings: Roundings::default(),
        })
    }
}

impl From<Scenario> for File {
    fn from(scenario: Scenario) -> Self {
        let count = scenario.robot_count();
        Self {
            name: scenario.name,
            description: scenario.description,
            seed: scenario.seed,
            duration_s: scenario.duration_s,
            step_s: scenario.step_s,
            arena: scenario.arena,
            robots: scenario.robots.into(),
            field: scenario.field,
            light: scenario.light.into(),
            sensors: scenario.sensors.into(),
            controller: Deferred::written(ControllerTables::of(scenario.controllers, count)),
            channel: scenario.channel.into(),
            convergence: scenario.convergence,
            processes: scenario.processes,
            output: scenario.output,
            fault: scenario.fault.into_iter().map(Deferred::written).collect(),
            fuzz: scenario.fuzz,
        }
    }
}

/// A table that is read by itself, entry by entry, because which keys it has depends on some of them: so each key keeps
/// its line.
struct Deferred<T>(Option<T>);

impl<T> Deferred<T> {
    fn written(table: T) -> Self {
        Self(Some(table))
    }
}

impl<'de, T> Deserialize<'de> for Deferred<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        IgnoredAny::deserialize(deserializer).map(|_| Self(None))
    }
}

impl<T: Serialize> Serialize for Deferred<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.0.serialize(serializer)
    }
}

impl<T: JsonSchema> JsonSchema for Deferred<T> {
    fn schema_name() -> Cow<'static, str> {
        T::schema_name()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        T::json_schema(generator)
    }
}

fn first_seed() -> Seed {
    constant!(Seed, 1)
}

fn file_stem(path: &str) -> String {
    Path::new(path).file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

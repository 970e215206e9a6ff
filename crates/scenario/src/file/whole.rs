//! The whole file: its tables, and the keys outside any.

use std::borrow::Cow;

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::de::IgnoredAny;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::arena::ArenaSpec;
use super::channel::ChannelKeys;
use super::controller::ControllerTables;
use super::convergence::ConvergenceSpec;
use super::field::FieldSpec;
use super::fuzz::FuzzSpec;
use super::light::LightKeys;
use super::output::OutputSpec;
use super::processes::ProcessesSpec;
use super::robots::RobotsKeys;
use super::sensors::SensorsKeys;
use crate::fault::kind::Fault;
use crate::number::{Positive, Seed};

/// A run of a robot swarm: the arena, the robots, what they sense, how they move and what is recorded.
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "Lamplight scenario")]
pub(crate) struct File {
    /// Name of the scenario; default: the file's name without `.toml`.
    #[serde(default)]
    pub(crate) name: String,
    /// One line about what the scenario shows.
    pub(crate) description: Option<String>,
    /// Seed of every random draw: the same seed gives the same run. At most 2^53 − 1, which every reader of JSON keeps.
    #[serde(default = "first_seed")]
    pub(crate) seed: Seed,
    /// Length of the run in seconds of virtual time: a whole number of steps, or rounded to one.
    pub(crate) duration_s: Positive,
    /// Length of one tick in seconds of virtual time.
    pub(crate) step_s: Positive,
    /// The arena the robots move in.
    pub(crate) arena: ArenaSpec,
    /// The robots' bodies and where they start.
    pub(crate) robots: RobotsKeys,
    /// The sensory function φ.
    #[serde(default)]
    pub(crate) field: FieldSpec,
    /// The light sensor of every robot.
    #[serde(default)]
    pub(crate) light: LightKeys,
    /// Other sensors.
    #[serde(default)]
    pub(crate) sensors: SensorsKeys,
    /// Controllers of the robots: `[controller]` for all, or a `[[controller]]` for some each.
    pub(crate) controller: Deferred<ControllerTables>,
    /// The infrared channel: who hears whom, and how well.
    pub(crate) channel: ChannelKeys,
    /// When the swarm counts as converged.
    #[serde(default)]
    pub(crate) convergence: ConvergenceSpec,
    /// How the robots' processes are supervised.
    #[serde(default)]
    pub(crate) processes: ProcessesSpec,
    /// Recorded outputs.
    #[serde(default)]
    pub(crate) output: OutputSpec,
    /// The fault plan: what shall go wrong, in the order in which faults see each packet and robot.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) fault: Vec<Deferred<Fault>>,
    /// Bounds of random fault plans, for `lamplight fuzz`.
    #[serde(default)]
    pub(crate) fuzz: FuzzSpec,
}

/// A table that is read by itself, entry by entry, because which keys it has depends on some of them: so each key keeps
/// its line.
pub(crate) struct Deferred<T>(Option<T>);

impl<T> Deferred<T> {
    pub(crate) fn written(table: T) -> Self {
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

//! Faults of all kinds: `kinds!` lists them.

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::{Deserialize, Serialize};

use super::drawer::Drawer;
use super::entry::Entry;
use super::nature::{Nature, Window};
use super::own_keys::OwnKeys;
use super::parameters::Parameters;
use super::target::{Choice, Target};
use crate::error::{Origin, ScenarioError};
use crate::number::NonNegative;
use crate::problem::Problem;
use crate::robot_set::RobotSet;
use crate::steps::Settling;

pub use partition::Parts;

/// One rule of the fault plan.
#[derive(Clone, Debug, PartialEq)]
pub struct Fault {
    /// When it is at work.
    pub window: Window,
    /// Robots, packets or links that it strikes.
    pub target: Target,
    /// Its kind, with the parameters.
    pub kind: Kind,
    /// Where it was written.
    pub origin: Origin,
}

macro_rules! kinds {
    ($($(#[$doc:meta])* $file:ident::$Kind:ident,)*) => {
        $(mod $file;)*
        $(pub use $file::$Kind;)*

        /// A kind of fault with its parameters.
        #[derive(Clone, Debug, PartialEq, Serialize)]
        #[serde(untagged)]
        pub enum Kind {
            $($(#[$doc])* $Kind($Kind),)*
        }

        /// Kind of fault.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
        #[serde(rename_all = "kebab-case")]
        pub enum FaultKind {
            $($(#[$doc])* $Kind,)*
        }

        impl FaultKind {
            /// Every kind, in the order of the guide.
            pub const ALL: &[Self] = &[$(Self::$Kind),*];

            /// As scenario files spell it.
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$Kind => stringify!($file),)*
                }
            }

            /// How it fits into a plan.
            pub fn nature(self) -> Nature {
                match self {
                    $(Self::$Kind => $Kind::NATURE,)*
                }
            }

            pub(super) fn schema(self, generator: &mut SchemaGenerator) -> Schema {
                match self {
                    $(Self::$Kind => $Kind::json_schema(generator),)*
                }
            }

            pub(super) fn read(self, own: OwnKeys<'_, '_>) -> Result<Kind, ScenarioError> {
                match self {
                    $(Self::$Kind => own.read().map(Kind::$Kind),)*
                }
            }

            pub(super) fn drawn(self, draw: &mut Drawer<'_>, window: &Window) -> Kind {
                match self {
                    $(Self::$Kind => Kind::$Kind($Kind::drawn(draw, window)),)*
                }
            }
        }

        impl Kind {
            /// Its kind without the parameters.
            pub fn kind(&self) -> FaultKind {
                match self {
                    $(Self::$Kind(_) => FaultKind::$Kind,)*
                }
            }

            /// Returns what comes late because of it, and by how many seconds at most.
            pub fn lateness(&self) -> Option<(&'static str, f64)> {
                match self {
                    $(Self::$Kind(it) => it.lateness(),)*
                }
            }

            pub(super) fn check(&self, entry: &Entry<'_>) -> Result<(), Problem> {
                match self {
                    $(Self::$Kind(it) => it.check(entry),)*
                }
            }

            fn settle(
                &mut self,
                path: &dyn Fn(&str) -> String,
                settling: &mut Settling<'_>,
            ) -> Result<(), Problem> {
                match self {
                    $(Self::$Kind(it) => it.settle(path, settling),)*
                }
            }

            fn cut(&mut self, count: u32) -> bool {
                match self {
                    $(Self::$Kind(it) => it.cut(count),)*
                }
            }
        }
    };
}

kinds! {
    /// Packets are lost, each by its own chance.
    loss::Loss,
    /// Packets are lost in bursts, link by link (Gilbert-Elliott).
    burst::Burst,
    /// Packets come late, and perhaps overtake each other.
    delay::Delay,
    /// Packets come twice.
    duplicate::Duplicate,
    /// Bits of packets flip.
    corrupt::Corrupt,
    /// Groups of robots cannot hear each other.
    partition::Partition,
    /// Robots inside a disc hear nothing.
    jam::Jam,
    /// Agents are killed (SIGKILL), and perhaps restarted.
    kill::Kill,
    /// Agents are stopped (SIGSTOP), and go on later (SIGCONT).
    pause::Pause,
    /// Answers of agents come late.
    slow::Slow,
    /// Light sensors read false values.
    sensor::Sensor,
    /// Bodies do not move as commanded.
    motion::Motion,
    /// Packets carry a false reading or a false name.
    liar::Liar,
    /// The sensory function φ changes.
    field::Field,
}

impl FaultKind {
    /// Every key that a fault of this kind may have, but for `kind`.
    pub fn keys(self) -> Vec<String> {
        let schema = self.schema(&mut SchemaGenerator::default());
        let own = schema.get("properties").and_then(serde_json::Value::as_object).into_iter().flatten();
        self.nature().keys().map(str::to_owned).chain(own.map(|(key, _)| key.clone())).collect()
    }
}

impl Fault {
    /// Its kind's name, as scenario files spell it.
    pub fn name(&self) -> &'static str {
        self.kind.kind().name()
    }

    /// How its kind fits into a plan.
    pub fn nature(&self) -> Nature {
        self.kind.kind().nature()
    }

    /// When it begins, seconds.
    pub fn begins_s(&self) -> f64 {
        self.window.from_s.get()
    }

    /// When it ends, seconds; `None` with the run, or if its kind has no end.
    pub fn ends_s(&self) -> Option<f64> {
        self.window.until_s.map(NonNegative::get)
    }

    /// Returns the same fault among the first `count` robots; `None` if it would strike nobody.
    pub fn among_first(&self, count: u32) -> Option<Self> {
        let mut cut = self.clone();
        (cut.target.cut(count) && cut.kind.cut(count)).then_some(cut)
    }

    /// Returns a robot of `count` that this fault and `other` would strike at once, though their kind must not. Only
    /// robots named outright are compared: who else is struck is known when the fault begins, and the ledger then
    /// tells whom it found.
    pub fn excludes(&self, other: &Self, count: u32) -> Option<u32> {
        let until_s = |fault: &Self| fault.ends_s().unwrap_or(f64::INFINITY);
        let overlap = self.begins_s() < until_s(other) && other.begins_s() < until_s(self);
        if self.kind.kind() != other.kind.kind() || !self.nature().exclusive || !overlap {
            return None;
        }
        let everyone = RobotSet::of(0..count);
        let named = |fault: &Self| match &fault.target {
            Target::Robots(Choice { robots, region: None, share: None }) => {
                robots.clone().or(everyone.clone())
            }
            _ => None,
        };
        named(self)?.lowest_common(&named(other)?)
    }

    /// Makes its times whole numbers of steps. `path` is that of a key.
    pub(crate) fn settle(
        &mut self,
        path: &dyn Fn(&str) -> String,
        settling: &mut Settling<'_>,
    ) -> Result<(), Problem> {
        let (from, until) = self.nature().window();
        settling.settle(&path(from), 0, Some(&mut self.window.from_s))?;
        if let Some(until) = until {
            settling.settle(&path(until), 0, self.window.until_s.as_mut())?;
        }
        self.kind.settle(path, settling)
    }
}

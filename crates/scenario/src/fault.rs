//! `[[fault]]`: what shall go wrong, when, and to whom.
//!
//! A kind of fault is one file here, with its parameters (the keys that only it has, with their defaults), what is
//! checked of them, and how a random one is drawn; and one line in `kinds!` below. What it does to packets and robots
//! is a rule of the same name in the crate `arena`. Everything else asks the kind for its [`Nature`].

mod draw;
mod entry;
mod read;
mod target;

use protocol::packet::frame_bytes;
use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::{Deserialize, Serialize, de::DeserializeOwned};

use super::error::{Origin, ScenarioError};
use super::number::Xy;
use super::number::{Finite, NonNegative, Positive};
use super::problem::Problem;
use super::robot_set::RobotSet;
use super::steps::Settling;

pub use draw::{Drawer, drawn};
pub(crate) use entry::check;
pub(crate) use read::read;
pub use target::{Choice, Direction, Pick, ShareOf, Target};

use entry::Entry;
use read::CommonKeys;

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

/// When a fault is at work.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window {
    /// When it begins, seconds.
    pub from_s: NonNegative,
    /// When it ends, seconds; `None` with the run. Who was killed is restarted then.
    pub until_s: Option<NonNegative>,
}

/// A disc of the arena.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Disc {
    /// Its center, [x, y] in meters.
    pub center_m: Xy<Finite>,
    /// Its radius in meters.
    pub radius_m: Positive,
}

/// How a kind of fault fits into a plan.
#[derive(Clone, Copy, Debug)]
pub struct Nature {
    /// Things that it strikes, and so the keys by which they are chosen.
    pub strikes: Strikes,
    /// Whether it happens at `at_s`, and ends by being undone at `restart_at_s`; others last from `from_s` to `until_s`.
    pub at_once: bool,
    /// Whether it may let a robot that speaks go unheard for a neighbor cycle.
    pub silences: bool,
    /// Whether no robot may be struck by two of its kind at once.
    pub exclusive: bool,
}

/// Things that a kind of fault strikes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Strikes {
    /// Packets that some robots send or hear, or on some links.
    Packets,
    /// Robots.
    Robots,
    /// Robots that must be chosen: never all of them for want of a key.
    ChosenRobots,
    /// Robots or packets that its own keys name.
    ByItsKeys,
}

impl Nature {
    const fn of(strikes: Strikes) -> Self {
        Self { strikes, at_once: false, silences: false, exclusive: false }
    }

    /// The keys of its window.
    fn window(self) -> [&'static str; 2] {
        if self.at_once { ["at_s", "restart_at_s"] } else { ["from_s", "until_s"] }
    }

    /// The keys that kinds share and this one has.
    fn keys(self) -> impl Iterator<Item = &'static str> {
        self.window().into_iter().chain(self.strikes.keys().iter().copied())
    }
}

impl Strikes {
    fn keys(self) -> &'static [&'static str] {
        match self {
            Self::Packets => &["robots", "region", "share", "pick", "direction", "links"],
            Self::Robots | Self::ChosenRobots => &["robots", "region", "share", "pick"],
            Self::ByItsKeys => &[],
        }
    }
}

/// Parameters of a kind of fault: the keys that only it has, as serde reads them.
trait Parameters: Sized + DeserializeOwned + JsonSchema {
    /// How the kind fits into a plan.
    const NATURE: Nature;

    /// Checks that the parameters can be, and do something.
    fn check(&self, _: &Entry<'_>) -> Result<(), Problem> {
        Ok(())
    }

    /// Makes times whole numbers of steps. `path` is that of a key.
    fn settle(&mut self, _path: &dyn Fn(&str) -> String, _: &mut Settling<'_>) -> Result<(), Problem> {
        Ok(())
    }

    /// Returns what comes late, and by how many seconds at most.
    fn lateness(&self) -> Option<(&'static str, f64)> {
        None
    }

    /// Leaves the first `count` robots alone; whether there is something left to strike.
    fn cut(&mut self, _count: u32) -> bool {
        true
    }

    /// Draws parameters at random, for a fault with this window.
    fn drawn(draw: &mut Drawer<'_>, window: &Window) -> Self;
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

            fn schema(self, generator: &mut SchemaGenerator) -> Schema {
                match self {
                    $(Self::$Kind => $Kind::json_schema(generator),)*
                }
            }

            fn read(self, own: read::Own<'_, '_>) -> Result<Kind, ScenarioError> {
                match self {
                    $(Self::$Kind => own.read().map(Kind::$Kind),)*
                }
            }

            fn drawn(self, draw: &mut Drawer<'_>, window: &Window) -> Kind {
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

            fn check(&self, entry: &Entry<'_>) -> Result<(), Problem> {
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
}

pub use partition::Parts;

/// Bits of a packet of the paper's robots.
const PACKET_BITS: u32 = 8 * frame_bytes(4) as u32;

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

    /// When it ends, seconds; `None` with the run.
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
        let [from, until] = self.nature().window();
        settling.settle(&path(from), 0, Some(&mut self.window.from_s))?;
        settling.settle(&path(until), 0, self.window.until_s.as_mut())?;
        self.kind.settle(path, settling)
    }
}

/// As a table of a scenario file, with every default.
impl Serialize for Fault {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        #[derive(Serialize)]
        struct Table<'a> {
            kind: FaultKind,
            #[serde(flatten)]
            common: CommonKeys,
            #[serde(flatten)]
            parameters: &'a Kind,
        }
        let table = Table { kind: self.kind.kind(), common: CommonKeys::of(self), parameters: &self.kind };
        table.serialize(serializer)
    }
}

//! `[[fault]]`: what shall go wrong, when, and to whom.
//!
//! One flat table for all kinds, because serde then names the line of every slip; [`super::fault_check`]
//! knows which keys each kind needs and knows.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::error::Place;
use super::hex::PayloadHex;
use super::number::{
    FaultCount, Finite, FlipCount, NonNegative, PayloadBytes, Positive, Probability, Share, Xy,
};
use super::robot_set::{Link, RobotSet};

/// One rule of the fault plan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FaultSpec {
    /// Kind of fault.
    pub kind: FaultKind,

    /// When it begins, seconds; default 0. Not for `kill`.
    pub from_s: Option<NonNegative>,
    /// When it ends, seconds; default: with the run. Not for `kill`.
    pub until_s: Option<NonNegative>,
    /// When the robots are killed, seconds. For `kill`.
    pub at_s: Option<NonNegative>,
    /// When killed robots are restarted without their memory, seconds; without it they stay dead. For `kill`.
    pub restart_at_s: Option<NonNegative>,
    /// The share of the killed robots that is restarted, drawn at random; default all. For `kill`.
    pub restart_share: Option<Share>,

    /// Which robots it strikes, such as "3, 7, 10-19"; default all.
    pub robots: Option<RobotSet>,
    /// Of these only robots inside this disc when it begins; for `jam` and `partition` the disc itself.
    pub region: Option<Disc>,
    /// Of these only this share.
    pub share: Option<Share>,
    /// How the share is chosen; default at random.
    pub pick: Option<Pick>,
    /// Whether packets that these robots send, hear, or both are struck; default both. For faults of packets.
    pub direction: Option<Direction>,
    /// Which links it strikes, such as ["3->7", "4<->9"], in place of robots. For faults of packets.
    pub links: Option<Vec<Link>>,
    /// Groups that cannot hear each other; robots in none of them are not struck. For `partition`.
    pub groups: Option<Vec<RobotSet>>,
    /// Whether only packets from an earlier to a later group (or out of the region) are dropped. For `partition`.
    pub one_way: Option<bool>,

    /// Chance that a packet is struck. For `loss`, `duplicate` and `corrupt`.
    pub probability: Option<Probability>,
    /// Chance per neighbor cycle that a good link turns bad. For `burst`.
    pub p: Option<Probability>,
    /// Chance per neighbor cycle that a bad link turns good. For `burst`.
    pub r: Option<Probability>,
    /// Chance that a packet is lost on a bad link (Gilbert-Elliott 1 − h); default 1. For `burst`.
    pub loss_bad: Option<Probability>,
    /// Chance that a packet is lost on a good link (Gilbert-Elliott 1 − k); default 0. For `burst`.
    pub loss_good: Option<Probability>,
    /// How late packets (`delay`), second copies (`duplicate`) or answers (`slow`) come, seconds.
    pub delay_s: Option<Positive>,
    /// Up to how much later still, uniformly at random, seconds; default 0. For `delay`.
    pub jitter_s: Option<NonNegative>,
    /// Bits flipped in each struck packet; its checksum finds every odd number of them, and two; of 4 a share of
    /// 3.3e-5 passes, of larger even numbers less; default 3. For `corrupt`.
    pub flips: Option<FlipCount>,

    /// Added to each light reading, counts. For `sensor`.
    pub bias_counts: Option<Finite>,
    /// Standard deviation of noise added to each light reading, counts. For `sensor`.
    pub noise_counts: Option<Positive>,
    /// Whether the reading (`sensor`) or the body (`motion`) is stuck where it was when the fault began.
    pub stuck: Option<bool>,
    /// Velocity added to the commanded one, [ahead, left] in meters per second. For `motion`.
    pub drift_m_per_s: Option<Xy<Finite>>,
    /// The light reading that packets falsely carry, counts. For `liar`.
    pub light_counts: Option<Finite>,
    /// Bytes that packets falsely carry in their payloads, such as "00c07f45", from `payload_offset` on. For `liar`.
    pub payload_hex: Option<PayloadHex>,
    /// Number of the first of these bytes in the payload, from 0; default 0. A packet whose payload ends before the last
    /// one is left as it is. For `liar`.
    pub payload_offset: Option<PayloadBytes>,
    /// The robot that packets falsely claim to come from. For `liar`.
    pub identity: Option<u32>,

    /// Where it was written.
    #[serde(skip)]
    pub origin: Origin,
}

/// Kind of fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum FaultKind {
    /// Packets are lost, each by its own chance.
    Loss,
    /// Packets are lost in bursts, link by link (Gilbert-Elliott).
    Burst,
    /// Packets come late, and perhaps overtake each other.
    Delay,
    /// Packets come twice.
    Duplicate,
    /// Bits of packets flip.
    Corrupt,
    /// Groups of robots cannot hear each other.
    Partition,
    /// Robots inside a disc hear nothing.
    Jam,
    /// Agents are killed (SIGKILL), and perhaps restarted.
    Kill,
    /// Agents are stopped (SIGSTOP), and go on later (SIGCONT).
    Pause,
    /// Answers of agents come late.
    Slow,
    /// Light sensors read false values.
    Sensor,
    /// Bodies do not move as commanded.
    Motion,
    /// Packets carry a false reading or a false name.
    Liar,
}

impl FaultKind {
    /// Every kind, in the order of the guide.
    pub const ALL: [Self; 13] = [
        Self::Loss,
        Self::Burst,
        Self::Delay,
        Self::Duplicate,
        Self::Corrupt,
        Self::Partition,
        Self::Jam,
        Self::Kill,
        Self::Pause,
        Self::Slow,
        Self::Sensor,
        Self::Motion,
        Self::Liar,
    ];

    /// As scenario files spell it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Loss => "loss",
            Self::Burst => "burst",
            Self::Delay => "delay",
            Self::Duplicate => "duplicate",
            Self::Corrupt => "corrupt",
            Self::Partition => "partition",
            Self::Jam => "jam",
            Self::Kill => "kill",
            Self::Pause => "pause",
            Self::Slow => "slow",
            Self::Sensor => "sensor",
            Self::Motion => "motion",
            Self::Liar => "liar",
        }
    }
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

/// How a share of some robots is chosen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Pick {
    /// At random.
    #[default]
    Random,
    /// The nearest to the middle of the lamps when it begins.
    NearestLamps,
}

/// Which packets of the chosen robots are struck.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Direction {
    /// Packets they send and packets they hear.
    #[default]
    Both,
    /// Packets they send.
    Out,
    /// Packets they hear.
    In,
}

impl FaultSpec {
    /// A fault of this kind with nothing else said.
    pub fn new(kind: FaultKind) -> Self {
        Self {
            kind,
            from_s: None,
            until_s: None,
            at_s: None,
            restart_at_s: None,
            restart_share: None,
            robots: None,
            region: None,
            share: None,
            pick: None,
            direction: None,
            links: None,
            groups: None,
            one_way: None,
            probability: None,
            p: None,
            r: None,
            loss_bad: None,
            loss_good: None,
            delay_s: None,
            jitter_s: None,
            flips: None,
            bias_counts: None,
            noise_counts: None,
            stuck: None,
            drift_m_per_s: None,
            light_counts: None,
            payload_hex: None,
            payload_offset: None,
            identity: None,
            origin: Origin::default(),
        }
    }

    /// When it begins, seconds.
    pub fn begins_s(&self) -> f64 {
        self.at_s.or(self.from_s).map_or(0.0, NonNegative::get)
    }

    /// When it ends, seconds; `None` with the run.
    pub fn ends_s(&self) -> Option<f64> {
        self.restart_at_s.or(self.until_s).map(NonNegative::get)
    }
}

/// Where something of a scenario was written: no part of what it means, so all origins are equal.
#[derive(Clone, Debug, Default)]
pub struct Origin(pub Option<Place>);

impl PartialEq for Origin {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

/// Bounds of the random fault plans of `lamplight fuzz`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct FuzzSpec {
    /// Most faults in one plan.
    pub faults_max: FaultCount,
    /// Kinds to draw from; default all.
    pub kinds: Vec<FaultKind>,
    /// Length of each run in seconds of virtual time; default `duration_s`, at most 20.
    pub duration_s: Option<Positive>,
    /// Highest chance of any kind.
    pub probability_max: Probability,
    /// Largest share of the robots that one fault strikes.
    pub share_max: Share,
    /// Longest delay of a packet or an answer, seconds.
    pub delay_max_s: Positive,
}

impl Default for FuzzSpec {
    fn default() -> Self {
        Self {
            faults_max: constant!(FaultCount, 6),
            kinds: FaultKind::ALL.to_vec(),
            duration_s: None,
            probability_max: constant!(Probability, 0.9),
            share_max: constant!(Share, 0.5),
            delay_max_s: constant!(Positive, 2.0),
        }
    }
}

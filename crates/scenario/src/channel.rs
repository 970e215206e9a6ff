//! `[channel]`: who hears whom, when packets are in the air, and how they are measured.
//!
//! A profile names a whole set of values; every key of the file overrides its own. Parsing fills in
//! what the file leaves open ([`ChannelSpec::filled`]), so a resolved scenario says everything.

use std::num::NonZeroU32;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::number::{NonNegative, PayloadBytes, Positive, Probability};
use super::steps::whole_part;

/// The infrared channel: who hears whom, and how well.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ChannelSpec {
    /// Preset of every key below that is not given.
    pub profile: Profile,
    /// Rule that decides who is in reach.
    pub model: ChannelModel,
    /// Distance in meters up to which a packet reaches; with `model = "range"` and only there.
    pub range_m: Option<Positive>,
    /// Width in meters of the outer rim of the range in which the chance to be reached falls from 1 to 0.
    pub soft_edge_m: Option<NonNegative>,
    /// Distance in meters up to which a packet that is too weak to be read still disturbs others; at least `range_m`,
    /// its default. Where it is more, packets that fade out on the soft edge disturb too. With `model = "range"`, and
    /// not with `access = "instant"`.
    pub interference_range_m: Option<Positive>,
    /// Whether bodies in the line of sight block packets.
    pub occlusion: Option<bool>,
    /// Whether packets that a body blocks still disturb others; default false. With `occlusion = true`, and not with
    /// `access = "instant"`.
    pub occluded_interference: Option<bool>,
    /// Neighbor cycle in seconds: each robot transmits one packet and runs its controller once in it;
    /// default 0.25, or `step_s` with `access = "instant"`.
    pub cycle_s: Option<Positive>,
    /// When in its cycle a robot transmits.
    pub access: Option<Access>,
    /// Time in seconds that a packet is in the air; default 0.005. Not with `access = "instant"`.
    pub airtime_s: Option<Positive>,
    /// End of a cycle, in seconds, in which no packet starts; default `airtime_s`. With `access = "random"`
    /// or `"aligned"`.
    pub guard_s: Option<NonNegative>,
    /// Slots per cycle; default as many as packets fit. With `access = "slotted"`.
    pub slots: Option<NonZeroU32>,
    /// Width in seconds of the uniform jitter around a robot's phase; default 0. With
    /// `access = "fixed-phase"`.
    pub jitter_s: Option<NonNegative>,
    /// Whether a robot that transmits hears nothing.
    pub half_duplex: Option<bool>,
    /// Capture rule: which of the packets that overlap in time a receiver reads.
    pub capture: Option<Capture>,
    /// Chance that a packet is lost between one sender and one receiver, independent of all others.
    pub loss: Option<Probability>,
    /// Standard deviation of a measured range, as a share of it.
    #[schemars(range(max = 1.0))]
    pub sigma_range: Option<NonNegative>,
    /// Standard deviation of a measured bearing, degrees.
    pub sigma_bearing_deg: Option<NonNegative>,
    /// Standard deviation of a measured orientation, degrees.
    pub sigma_orientation_deg: Option<NonNegative>,
    /// Step in meters in which ranges are told apart, each as the middle of its step; 0 for none.
    pub range_step_m: Option<NonNegative>,
    /// Step in degrees in which bearings are told apart, a whole number of them to a turn of 360; 0 for none.
    pub bearing_step_deg: Option<NonNegative>,
    /// Step in degrees in which orientations are told apart, a whole number of them to a turn of 360; 0 for none.
    pub orientation_step_deg: Option<NonNegative>,
    /// Longest payload of a packet that is accepted, in bytes; default 9, up to which payloads cost nothing. A command
    /// with a longer one is refused. The paper's robots send 4 bytes. It does not change how long a packet is in the air.
    pub payload_bytes_max: PayloadBytes,
}

/// A named set of channel parameters.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Profile {
    /// Every packet in reach is heard at once and measured exactly.
    #[default]
    Ideal,
    /// The SwarmBot's infrared: cycle 0.25 s, airtime 5 ms, range 1 m, half duplex; 5 % and 2 degrees of noise.
    Isis,
    /// The r-one's: cycle 0.5 s, airtime 30 ms, a receiver keeps the first packet; steps of 0.27 m and 22.5 degrees.
    ROne,
}

/// Rule that decides who is in reach.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ChannelModel {
    /// Every robot within range.
    #[default]
    Range,
    /// Every Voronoi neighbor, however far: the paper's assumption.
    Voronoi,
}

/// When in its cycle a robot transmits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Access {
    /// At the beginning of the next one, in no time: packets never meet.
    Instant,
    /// Anywhere in its own free-running cycle.
    Random,
    /// Anywhere in a cycle that all robots share.
    Aligned,
    /// In a random slot of a cycle that all robots share.
    Slotted,
    /// At the robot's own phase, always the same but for jitter.
    FixedPhase,
}

/// Capture rule: which of the packets that overlap in time a receiver reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Capture {
    /// None: they destroy each other.
    None,
    /// The first one, to its end; those that start meanwhile are lost.
    FirstLock,
}

/// Values of a profile, for keys that a scenario leaves open.
struct Preset {
    access: Access,
    cycle_s: Option<Positive>,
    airtime_s: Positive,
    range_m: Option<Positive>,
    half_duplex: bool,
    capture: Capture,
    sigma_range: NonNegative,
    sigma_angle_deg: NonNegative,
    range_step_m: NonNegative,
    angle_step_deg: NonNegative,
}

impl Profile {
    /// Sources: the paper (range), published descriptions of the r-one (cycle, airtime of 21 to 42 ms, steps
    /// of range, first arrival), and estimates where nothing is published (ISIS: airtime 5 to 10 ms, range
    /// 2 to 8 %, bearing 2 to 5 degrees).
    fn preset(self) -> Preset {
        let isis = Preset {
            access: Access::Random,
            cycle_s: Some(constant!(Positive, 0.25)),
            airtime_s: constant!(Positive, 0.005),
            range_m: Some(constant!(Positive, 1.0)),
            half_duplex: true,
            capture: Capture::None,
            sigma_range: constant!(NonNegative, 0.05),
            sigma_angle_deg: constant!(NonNegative, 2.0),
            range_step_m: NONE,
            angle_step_deg: NONE,
        };
        match self {
            Self::Ideal => Preset {
                access: Access::Instant,
                cycle_s: None,
                range_m: None,
                half_duplex: false,
                sigma_range: NONE,
                sigma_angle_deg: NONE,
                ..isis
            },
            Self::Isis => isis,
            Self::ROne => Preset {
                cycle_s: Some(constant!(Positive, 0.5)),
                airtime_s: constant!(Positive, 0.03),
                capture: Capture::FirstLock,
                sigma_range: NONE,
                sigma_angle_deg: NONE,
                range_step_m: constant!(NonNegative, 0.27),
                angle_step_deg: constant!(NonNegative, 22.5),
                ..isis
            },
        }
    }
}

const NONE: NonNegative = constant!(NonNegative, 0.0);
const DEFAULT_CYCLE_S: Positive = constant!(Positive, 0.25);

impl ChannelSpec {
    /// The same with every key that has a meaning here written out.
    pub(super) fn filled(mut self, step_s: Positive) -> Self {
        let preset = self.profile.preset();
        if self.model == ChannelModel::Range {
            self.range_m = self.range_m.or(preset.range_m);
            self.soft_edge_m.get_or_insert(NONE);
        }
        let occlusion = *self.occlusion.get_or_insert(false);
        let access = *self.access.get_or_insert(preset.access);
        let cycle_s = preset.cycle_s.unwrap_or(match access {
            Access::Instant => step_s,
            _ => DEFAULT_CYCLE_S,
        });
        let cycle_s = *self.cycle_s.get_or_insert(cycle_s);
        if access != Access::Instant {
            let airtime_s = *self.airtime_s.get_or_insert(preset.airtime_s);
            self.half_duplex.get_or_insert(preset.half_duplex);
            self.capture.get_or_insert(preset.capture);
            if self.model == ChannelModel::Range {
                self.interference_range_m = self.interference_range_m.or(self.range_m);
            }
            if occlusion {
                self.occluded_interference.get_or_insert(false);
            }
            match access {
                Access::Random | Access::Aligned => {
                    let guard_s = NonNegative::new(airtime_s.get()).expect("a positive number is one");
                    self.guard_s.get_or_insert(guard_s);
                }
                Access::Slotted => {
                    let fit = u32::try_from(whole_part(cycle_s.get() / airtime_s.get())).unwrap_or(u32::MAX);
                    self.slots.get_or_insert(NonZeroU32::new(fit).unwrap_or(NonZeroU32::MIN));
                }
                Access::FixedPhase => {
                    self.jitter_s.get_or_insert(NONE);
                }
                Access::Instant => {}
            }
        }
        self.loss.get_or_insert(constant!(Probability, 0.0));
        self.sigma_range.get_or_insert(preset.sigma_range);
        self.sigma_bearing_deg.get_or_insert(preset.sigma_angle_deg);
        self.sigma_orientation_deg.get_or_insert(preset.sigma_angle_deg);
        self.range_step_m.get_or_insert(preset.range_step_m);
        self.bearing_step_deg.get_or_insert(preset.angle_step_deg);
        self.orientation_step_deg.get_or_insert(preset.angle_step_deg);
        self
    }

    /// The keys given here that mean nothing with this way of access.
    pub(super) fn meaningless_with_access(&self) -> impl Iterator<Item = &'static str> {
        let access = self.access.unwrap_or(self.profile.preset().access);
        let timed = access != Access::Instant;
        let guarded = matches!(access, Access::Random | Access::Aligned);
        [
            ("airtime_s", self.airtime_s.is_some() && !timed),
            ("half_duplex", self.half_duplex.is_some() && !timed),
            ("capture", self.capture.is_some() && !timed),
            ("interference_range_m", self.interference_range_m.is_some() && !timed),
            ("occluded_interference", self.occluded_interference.is_some() && !timed),
            ("guard_s", self.guard_s.is_some() && !guarded),
            ("slots", self.slots.is_some() && access != Access::Slotted),
            ("jitter_s", self.jitter_s.is_some() && access != Access::FixedPhase),
        ]
        .into_iter()
        .filter_map(|(key, meaningless)| meaningless.then_some(key))
    }
}

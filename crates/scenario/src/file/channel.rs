//! `[channel]`: who hears whom, when packets are in the air, and how they are measured.
//!
//! A profile names a whole set of values; every key of the file overrides its own.

use std::num::NonZeroU32;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::choice::{spelled, without_meaning};
use crate::channel::{Access, Air, Capture, ChannelModel, ChannelSpec, Medium, Profile};
use crate::number::{NonNegative, PayloadBytes, Positive, Probability};
use crate::problem::{Problem, problem};
use crate::steps::whole_part;

/// The infrared channel: who hears whom, and how well.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ChannelKeys {
    /// Preset of every key below that is not given.
    pub profile: Profile,
    /// Rule that decides who is in reach.
    pub model: ModelKey,
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
    pub access: Option<AccessKey>,
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

/// Rule that decides who is in reach.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ModelKey {
    /// Every robot within range.
    #[default]
    Range,
    /// Every Voronoi neighbor, however far: the paper's assumption.
    Voronoi,
}

/// When in its cycle a robot transmits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum AccessKey {
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

/// Values of a profile, for keys that a scenario leaves open.
struct Preset {
    access: AccessKey,
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
            access: AccessKey::Random,
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
                access: AccessKey::Instant,
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

impl ChannelKeys {
    /// The channel with every parameter that it has, in ticks of `step_s`.
    pub fn resolve(self, step_s: Positive) -> Result<ChannelSpec, Problem> {
        let preset = self.profile.preset();
        let access = self.access.unwrap_or(preset.access);
        self.refuse_without_meaning(access)?;
        let cycle_s = self.cycle_s.or(preset.cycle_s).unwrap_or(match access {
            AccessKey::Instant => step_s,
            _ => DEFAULT_CYCLE_S,
        });
        let model = match (self.model, self.range_m.or(preset.range_m)) {
            (ModelKey::Voronoi, _) => ChannelModel::Voronoi,
            (ModelKey::Range, Some(range_m)) => ChannelModel::Range {
                range_m,
                soft_edge_m: self.soft_edge_m.unwrap_or(NONE),
                interference_range_m: self.interference_range_m.unwrap_or(range_m),
            },
            (ModelKey::Range, None) => {
                let message = "channel.model = \"range\" needs `range_m` in [channel]";
                return Err(problem(&["channel.model"], message));
            }
        };
        let airtime_s = self.airtime_s.unwrap_or(preset.airtime_s);
        let guard_s =
            || self.guard_s.unwrap_or(NonNegative::new(airtime_s.get()).expect("a positive number is one"));
        let access = match access {
            AccessKey::Instant => None,
            AccessKey::Random => Some(Access::Random { guard_s: guard_s() }),
            AccessKey::Aligned => Some(Access::Aligned { guard_s: guard_s() }),
            AccessKey::Slotted => {
                let fit = u32::try_from(whole_part(cycle_s.get() / airtime_s.get())).unwrap_or(u32::MAX);
                let fit = NonZeroU32::new(fit).unwrap_or(NonZeroU32::MIN);
                Some(Access::Slotted { slots: self.slots.unwrap_or(fit) })
            }
            AccessKey::FixedPhase => Some(Access::FixedPhase { jitter_s: self.jitter_s.unwrap_or(NONE) }),
        };
        let medium = access.map_or(Medium::Instant, |access| {
            Medium::Timed(Air {
                access,
                airtime_s,
                half_duplex: self.half_duplex.unwrap_or(preset.half_duplex),
                capture: self.capture.unwrap_or(preset.capture),
                occluded_interference: self.occluded_interference.unwrap_or(false),
            })
        });
        Ok(ChannelSpec {
            profile: self.profile,
            model,
            occlusion: self.occlusion.unwrap_or(false),
            cycle_s,
            medium,
            loss: self.loss.unwrap_or(constant!(Probability, 0.0)),
            sigma_range: self.sigma_range.unwrap_or(preset.sigma_range),
            sigma_bearing_deg: self.sigma_bearing_deg.unwrap_or(preset.sigma_angle_deg),
            sigma_orientation_deg: self.sigma_orientation_deg.unwrap_or(preset.sigma_angle_deg),
            range_step_m: self.range_step_m.unwrap_or(preset.range_step_m),
            bearing_step_deg: self.bearing_step_deg.unwrap_or(preset.angle_step_deg),
            orientation_step_deg: self.orientation_step_deg.unwrap_or(preset.angle_step_deg),
            payload_bytes_max: self.payload_bytes_max,
        })
    }

    /// Refuses keys that mean nothing with the other keys.
    fn refuse_without_meaning(&self, access: AccessKey) -> Result<(), Problem> {
        if self.model == ModelKey::Voronoi {
            let of_a_range = [
                ("range_m", self.range_m.is_some()),
                ("soft_edge_m", self.soft_edge_m.is_some()),
                ("interference_range_m", self.interference_range_m.is_some()),
            ];
            if let Some((key, _)) = of_a_range.into_iter().find(|(_, given)| *given) {
                return Err(without_meaning(&format!("channel.{key}"), "channel.model", "voronoi"));
            }
        }
        if self.occluded_interference.is_some() && self.occlusion != Some(true) {
            let path = "channel.occluded_interference";
            let message =
                format!("{path} has no meaning without channel.occlusion = true: bodies block nothing");
            let hint = format!("remove it (on the command line: --set {path}=)");
            return Err(problem(&[path], message).hint(hint));
        }
        let timed = access != AccessKey::Instant;
        let guarded = matches!(access, AccessKey::Random | AccessKey::Aligned);
        let of_access = [
            ("airtime_s", self.airtime_s.is_some() && !timed),
            ("half_duplex", self.half_duplex.is_some() && !timed),
            ("capture", self.capture.is_some() && !timed),
            ("interference_range_m", self.interference_range_m.is_some() && !timed),
            ("occluded_interference", self.occluded_interference.is_some() && !timed),
            ("guard_s", self.guard_s.is_some() && !guarded),
            ("slots", self.slots.is_some() && access != AccessKey::Slotted),
            ("jitter_s", self.jitter_s.is_some() && access != AccessKey::FixedPhase),
        ];
        let Some((key, _)) = of_access.into_iter().find(|(_, meaningless)| *meaningless) else {
            return Ok(());
        };
        let (choice, chosen) = match self.access {
            Some(access) => ("channel.access", spelled(&access)),
            None => ("channel.profile", spelled(&self.profile)),
        };
        Err(without_meaning(&format!("channel.{key}"), choice, &chosen))
    }
}

impl From<ChannelSpec> for ChannelKeys {
    fn from(channel: ChannelSpec) -> Self {
        let mut keys = Self {
            profile: channel.profile,
            occlusion: Some(channel.occlusion),
            cycle_s: Some(channel.cycle_s),
            access: Some(AccessKey::Instant),
            loss: Some(channel.loss),
            sigma_range: Some(channel.sigma_range),
            sigma_bearing_deg: Some(channel.sigma_bearing_deg),
            sigma_orientation_deg: Some(channel.sigma_orientation_deg),
            range_step_m: Some(channel.range_step_m),
            bearing_step_deg: Some(channel.bearing_step_deg),
            orientation_step_deg: Some(channel.orientation_step_deg),
            payload_bytes_max: channel.payload_bytes_max,
            ..Self::default()
        };
        let is_timed = matches!(channel.medium, Medium::Timed(_));
        match channel.model {
            ChannelModel::Voronoi => keys.model = ModelKey::Voronoi,
            ChannelModel::Range { range_m, soft_edge_m, interference_range_m } => {
                keys.range_m = Some(range_m);
                keys.soft_edge_m = Some(soft_edge_m);
                keys.interference_range_m = is_timed.then_some(interference_range_m);
            }
        }
        let Medium::Timed(air) = channel.medium else { return keys };
        keys.airtime_s = Some(air.airtime_s);
        keys.half_duplex = Some(air.half_duplex);
        keys.capture = Some(air.capture);
        keys.occluded_interference = channel.occlusion.then_some(air.occluded_interference);
        let access = match air.access {
            Access::Random { guard_s } => {
                keys.guard_s = Some(guard_s);
                AccessKey::Random
            }
            Access::Aligned { guard_s } => {
                keys.guard_s = Some(guard_s);
                AccessKey::Aligned
            }
            Access::Slotted { slots } => {
                keys.slots = Some(slots);
                AccessKey::Slotted
            }
            Access::FixedPhase { jitter_s } => {
                keys.jitter_s = Some(jitter_s);
                AccessKey::FixedPhase
            }
        };
        keys.access = Some(access);
        keys
    }
}

//! The infrared channel, resolved: who hears whom, when packets are in the air, and how they are measured.

use std::num::NonZeroU32;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::number::{NonNegative, PayloadBytes, Positive, Probability};

/// The infrared channel: who hears whom, and how well.
#[derive(Clone, Debug, PartialEq)]
pub struct ChannelSpec {
    /// The preset that it was made of.
    pub profile: Profile,
    /// Rule that decides who is in reach.
    pub model: ChannelModel,
    /// Whether bodies in the line of sight block packets.
    pub occlusion: bool,
    /// Neighbor cycle in seconds: each robot transmits one packet and runs its controller once in it.
    pub cycle_s: Positive,
    /// Time that packets take, and what becomes of those that overlap.
    pub medium: Medium,
    /// Chance that a packet is lost between one sender and one receiver, independent of all others.
    pub loss: Probability,
    /// Standard deviation of a measured range, as a share of it.
    pub sigma_range: NonNegative,
    /// Standard deviation of a measured bearing, degrees.
    pub sigma_bearing_deg: NonNegative,
    /// Standard deviation of a measured orientation, degrees.
    pub sigma_orientation_deg: NonNegative,
    /// Step in meters in which ranges are told apart; 0 for none.
    pub range_step_m: NonNegative,
    /// Step in degrees in which bearings are told apart; 0 for none.
    pub bearing_step_deg: NonNegative,
    /// Step in degrees in which orientations are told apart; 0 for none.
    pub orientation_step_deg: NonNegative,
    /// Longest payload of a packet that is accepted, in bytes.
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
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ChannelModel {
    /// Every robot within range.
    Range {
        /// Distance in meters up to which a packet reaches.
        range_m: Positive,
        /// Width in meters of the outer rim of the range in which the chance to be reached falls from 1 to 0.
        soft_edge_m: NonNegative,
        /// Distance in meters up to which a packet disturbs others, at least the range.
        interference_range_m: Positive,
    },
    /// Every Voronoi neighbor, however far: the paper's assumption.
    Voronoi,
}

/// Time that packets take.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Medium {
    /// None: they are heard at the beginning of the next cycle, and never meet.
    Instant,
    /// They last, and may overlap.
    Timed(Air),
}

/// Packets that last.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Air {
    /// When in its cycle a robot transmits.
    pub access: Access,
    /// Time in seconds that a packet is in the air.
    pub airtime_s: Positive,
    /// Whether a robot that transmits hears nothing.
    pub half_duplex: bool,
    /// Which of the packets that overlap in time a receiver reads.
    pub capture: Capture,
    /// Whether packets that a body blocks still disturb others.
    pub occluded_interference: bool,
}

/// When in its cycle a robot transmits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Access {
    /// Anywhere in its own free-running cycle.
    Random {
        /// End of a cycle, in seconds, in which no packet starts.
        guard_s: NonNegative,
    },
    /// Anywhere in a cycle that all robots share.
    Aligned {
        /// End of a cycle, in seconds, in which no packet starts.
        guard_s: NonNegative,
    },
    /// In a random slot of a cycle that all robots share.
    Slotted {
        /// Slots per cycle.
        slots: NonZeroU32,
    },
    /// At the robot's own phase, always the same but for jitter.
    FixedPhase {
        /// Width in seconds of the uniform jitter around it.
        jitter_s: NonNegative,
    },
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

impl ChannelSpec {
    /// Returns the air of a timed channel; `None` where packets take no time.
    pub fn air(&self) -> Option<&Air> {
        match &self.medium {
            Medium::Instant => None,
            Medium::Timed(air) => Some(air),
        }
    }
}

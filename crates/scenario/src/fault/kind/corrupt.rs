//! `corrupt`: bits flip on the way, and the packet's checksum decides what becomes of it.

use protocol::packet::frame_bytes;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::fault::drawer::Drawer;
use crate::fault::nature::{Nature, Strikes, Window};
use crate::fault::parameters::Parameters;
use crate::number::{FlipCount, Probability};

/// Bits of a packet of the paper's robots.
const PACKET_BITS: u32 = 8 * frame_bytes(4) as u32;

/// Bits of packets flip.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Corrupt {
    /// Chance that a packet is struck.
    pub probability: Probability,
    /// Bits flipped in each struck packet; its checksum finds every odd number of them, and two; of 4 a share of
    /// 3.3e-5 passes, of larger even numbers less; default 3.
    #[serde(default = "three")]
    pub flips: FlipCount,
}

/// A number that the checksum always finds, being odd.
fn three() -> FlipCount {
    constant!(FlipCount, 3)
}

impl Parameters for Corrupt {
    const NATURE: Nature = Nature { silences: true, ..Nature::of(Strikes::Packets) };

    fn drawn(draw: &mut Drawer<'_>, _: &Window) -> Self {
        let probability = draw.probability();
        let flips = draw.chance(0.7).then(|| FlipCount::new(1 + draw.below(PACKET_BITS.into()) as u32));
        Self { probability, flips: flips.flatten().unwrap_or(three()) }
    }
}

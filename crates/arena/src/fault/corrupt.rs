//! `corrupt`: bits flip on the way, and the packet's checksum decides what becomes of it.

use protocol::packet::Packet;

use super::{
    rng::FaultRng,
    rule::{Flight, Rule, Verdict},
};
use crate::random::Draws;
use scenario::{Scenario, fault};

#[derive(Debug)]
pub(super) struct Corrupt {
    probability: f64,
    flips: u32,
}

impl Corrupt {
    pub(super) fn new(spec: &fault::Corrupt, _: &Scenario) -> Self {
        Self { probability: spec.probability.get(), flips: spec.flips.get() }
    }
}

impl Rule for Corrupt {
    fn judge(&mut self, flight: &Flight, rng: FaultRng) -> Verdict {
        let mut draws = rng.of(&flight.reception);
        if !draws.chance(self.probability) {
            return Verdict::Pass;
        }
        match Packet::decode(&flipped(&flight.reception.packet, self.flips, &mut draws)) {
            Ok(packet) => Verdict::Alter(packet),
            Err(_) => Verdict::Drop("packets corrupted and refused"),
        }
    }
}

/// The packet's frame with so many different bits flipped.
fn flipped(packet: &Packet, flips: u32, draws: &mut Draws) -> Vec<u8> {
    let mut bytes = packet.encode().to_vec();
    let mut bits: Vec<u32> = (0..8 * bytes.len() as u32).collect();
    for _ in 0..flips {
        let bit = bits.swap_remove(draws.below(bits.len() as u32) as usize);
        bytes[bit as usize / 8] ^= 1 << (bit % 8);
    }
    bytes
}

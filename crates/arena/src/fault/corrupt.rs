//! `corrupt`: bits flip on the way, and the packet's checksum decides what becomes of it.

use protocol::packet::PacketView;

use super::{
    rng::FaultRng,
    rule::{Flight, Rule, Verdict},
};
use crate::payloads::Payloads;
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
    fn judge(&mut self, flight: &Flight, rng: FaultRng, payloads: &mut Payloads) -> Verdict {
        let mut draws = rng.of(&flight.reception);
        if !draws.chance(self.probability) {
            return Verdict::Pass;
        }
        let packet = &flight.reception.packet;
        let mut frame = packet.view(payloads.of(packet)).encode();
        flip(&mut frame, self.flips, &mut draws);
        match PacketView::decode(&frame) {
            Ok(altered) => Verdict::Alter(payloads.packet(&altered)),
            Err(_) => Verdict::Drop("packets corrupted and refused"),
        }
    }
}

/// Flips so many different bits of a frame, or all if it has no more.
fn flip(frame: &mut [u8], flips: u32, draws: &mut Draws) {
    let mut bits: Vec<u32> = (0..8 * frame.len() as u32).collect();
    for _ in 0..flips.min(bits.len() as u32) {
        let bit = bits.swap_remove(draws.below(bits.len() as u32) as usize);
        frame[bit as usize / 8] ^= 1 << (bit % 8);
    }
}

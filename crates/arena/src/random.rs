//! Keyed random draws.
//!
//! A draw is a function of (seed, purpose, tick, sender, receiver): the key is the seed of a
//! ChaCha8 stream of its own. No draw depends on how many others were made before it, so adding a
//! robot, a fault or a thread leaves everyone else's draws alone.

use std::f64::consts::TAU;

use rand_chacha::{
    ChaCha8Rng,
    rand_core::{Rng, SeedableRng},
};

/// Purpose of a draw. The numbers are part of what a seed means: never reuse or renumber one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Purpose {
    /// Where a robot stands at the start; the tick counts attempts.
    StartPosition = 1,
    /// Which way it faces at the start.
    StartHeading = 2,
    /// The phase of a robot's free-running cycle. (How long it is, is drawn in [`protocol::oscillator`].)
    Phase = 3,
    /// When in a cycle a robot transmits; the tick counts its packets.
    Transmission = 4,
    /// Whether a packet fades out on its way; the tick counts the sender's packets.
    SoftEdge = 5,
    /// Noise of a measurement; the tick counts the sender's packets.
    Measurement = 6,
    /// Whether the channel loses a packet; the tick counts the sender's packets.
    ChannelLoss = 7,
    /// The gain of a photodiode; the receiver counts diodes.
    DiodeGain = 8,
    /// Noise of a ring's readings.
    DiodeNoise = 9,
    /// Choice of the robots that a fault strikes.
    FaultChoice = 10,
    /// Effect of a fault on a packet; the tick counts the sender's packets.
    FaultPacket = 11,
    /// Effect of a fault on a reading.
    FaultReading = 12,
    /// The random fault plan of `lamplight fuzz`; the tick is the fault's place in it, counted from 1, or 0
    /// for their number.
    FuzzPlan = 13,
    /// The random channel of `lamplight fuzz`.
    FuzzChannel = 14,
    /// The error of a robot's odometry.
    Odometry = 15,
}

/// The stream of one key.
#[derive(Clone, Debug)]
pub struct Draws(ChaCha8Rng);

impl Draws {
    /// The stream for one event. Use 0 for what an event does not have.
    pub fn of(seed: u64, purpose: Purpose, tick: u64, sender: u32, receiver: u32) -> Self {
        Self::keyed(seed, purpose, tick, sender, receiver, 0)
    }

    /// The stream of one fault for one event: each fault of a plan has draws of its own.
    pub fn of_fault(fault: u32, seed: u64, purpose: Purpose, tick: u64, sender: u32, receiver: u32) -> Self {
        Self::keyed(seed, purpose, tick, sender, receiver, fault + 1)
    }

    fn keyed(seed: u64, purpose: Purpose, tick: u64, sender: u32, receiver: u32, salt: u32) -> Self {
        let mut key = [0; 32];
        key[..8].copy_from_slice(&seed.to_le_bytes());
        key[8..16].copy_from_slice(&tick.to_le_bytes());
        key[16..20].copy_from_slice(&(purpose as u32).to_le_bytes());
        key[20..24].copy_from_slice(&sender.to_le_bytes());
        key[24..28].copy_from_slice(&receiver.to_le_bytes());
        key[28..].copy_from_slice(&salt.to_le_bytes());
        Self(ChaCha8Rng::from_seed(key))
    }

    /// Uniform in [0, 1), 53 bits.
    pub fn unit(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 * (1.0 / (1_u64 << 53) as f64)
    }

    /// Uniform in [low, high).
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Uniform among the first `count` whole numbers.
    pub fn below(&mut self, count: u32) -> u32 {
        // The product may round up to `count`.
        ((self.unit() * f64::from(count)) as u32).min(count.saturating_sub(1))
    }

    /// True with this probability.
    pub fn chance(&mut self, probability: f64) -> bool {
        self.unit() < probability
    }

    /// Standard normal (Box and Muller).
    pub fn normal(&mut self) -> f64 {
        let radius = libm::sqrt(-2.0 * libm::log(1.0 - self.unit()));
        radius * libm::cos(TAU * self.unit())
    }
}
#[cfg(test)]
mod tests {
    use super::*;

    fn first(seed: u64, purpose: Purpose, tick: u64, sender: u32, receiver: u32) -> f64 {
        Draws::of(seed, purpose, tick, sender, receiver).unit()
    }

    #[test]
    fn the_same_key_draws_the_same_number_and_any_other_key_another() {
        let base = first(1, Purpose::StartPosition, 2, 3, 4);
        assert_eq!(base, first(1, Purpose::StartPosition, 2, 3, 4));
        for other in [
            first(2, Purpose::StartPosition, 2, 3, 4),
            first(1, Purpose::StartHeading, 2, 3, 4),
            first(1, Purpose::StartPosition, 3, 3, 4),
            first(1, Purpose::StartPosition, 2, 4, 4),
            first(1, Purpose::StartPosition, 2, 3, 5),
        ] {
            assert_ne!(base, other);
        }
    }

    #[test]
    fn what_a_seed_means_does_not_change_between_versions() {
        assert_eq!(first(1, Purpose::StartPosition, 0, 0, 0).to_bits(), 0x3fd9_5eee_9c76_dac0);
    }

    #[test]
    fn faults_have_luck_of_their_own() {
        let first = |fault| Draws::of_fault(fault, 1, Purpose::FaultPacket, 2, 3, 4).unit();
        assert_ne!(first(0), first(1));
    }

    #[test]
    fn normal_draws_have_mean_zero_and_variance_one() {
        let draws = |i| Draws::of(7, Purpose::Measurement, 0, i, 0).normal();
        let (mean, square) = (0..20_000)
            .map(draws)
            .fold((0.0, 0.0), |(mean, square), x| (mean + x / 2e4, square + x * x / 2e4));
        // Four standard errors.
        assert!(mean.abs() < 4.0 / 2e4_f64.sqrt(), "{mean}");
        assert!((square - 1.0).abs() < 4.0 * (2.0_f64 / 2e4).sqrt(), "{square}");
    }

    #[test]
    fn draws_are_uniform() {
        let mean = (0..10_000).map(|i| first(7, Purpose::StartHeading, 0, i, 0)).sum::<f64>() / 1e4;
        assert!((mean - 0.5).abs() < 4.0 / (12.0_f64 * 1e4).sqrt(), "{mean}");
    }
}

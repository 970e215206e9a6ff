//! A robot's own clock: as even as its oscillator, which runs a little fast or slow.
//!
//! Both who keeps time by it (an agent's timer in real time) and who models it (the arena's infrared) draw it here,
//! so that they agree.

use rand_chacha::{
    ChaCha8Rng,
    rand_core::{Rng, SeedableRng},
};

use crate::robot_id::RobotId;

/// The oscillator of one life of a robot: another life has another one.
#[derive(Clone, Debug)]
pub struct Oscillator {
    drift: f64,
    draws: ChaCha8Rng,
}

impl Oscillator {
    /// The one that `seed` gives life `id`, with a drift drawn evenly from −`drift_ppm` to `drift_ppm` parts per
    /// million: the same in every run of the seed.
    pub fn of(id: RobotId, seed: u64, drift_ppm: f64) -> Self {
        let mut key = [0; 32];
        key[..8].copy_from_slice(&seed.to_le_bytes());
        key[8..12].copy_from_slice(&id.index.to_le_bytes());
        key[12..14].copy_from_slice(&id.incarnation.to_le_bytes());
        let mut draws = ChaCha8Rng::from_seed(key);
        let drift = drift_ppm * 1e-6 * (2.0 * unit(&mut draws) - 1.0);
        Self { drift, draws }
    }

    /// By what share its periods are longer than they should be; negative where it runs fast.
    pub fn drift(&self) -> f64 {
        self.drift
    }

    /// A draw for what differs from one period to the next, uniform in [0, 1).
    pub fn draw(&mut self) -> f64 {
        unit(&mut self.draws)
    }
}

/// Uniform in [0, 1), 53 bits.
fn unit(draws: &mut ChaCha8Rng) -> f64 {
    (draws.next_u64() >> 11) as f64 * (1.0 / (1_u64 << 53) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_life_has_a_drift_of_its_own_within_the_bound() {
        let drift = |id| Oscillator::of(id, 7, 100.0).drift();
        let lives = (0..100).flat_map(|index| [RobotId::first(index), RobotId::first(index).reborn()]);
        let mut drifts: std::vec::Vec<f64> = lives.map(drift).collect();
        assert!(drifts.iter().all(|drift| drift.abs() <= 100e-6));
        drifts.sort_by(f64::total_cmp);
        assert!(drifts.windows(2).all(|pair| pair[0] < pair[1]), "no two are alike");
        assert!((60..140).contains(&drifts.iter().filter(|drift| **drift < 0.0).count()));
        assert_eq!(drift(RobotId::first(3)), drift(RobotId::first(3)));
    }

    #[test]
    fn what_a_seed_means_does_not_change_between_versions() {
        let mut clock = Oscillator::of(RobotId { index: 3, incarnation: 1 }, 7, 1e6);
        assert_eq!(
            (clock.drift().to_bits(), clock.draw().to_bits()),
            (0x3fe4_f822_4f96_10b8, 0x3fe6_5c4e_f4a8_9745)
        );
    }
}

//! Odometry: each robot's own estimate of its motion, where the scenario grants it.
//!
//! Wheels count what they roll: what the body was told to do, and what a wall or another body holds back or pushes on
//! along their course. They do not count what pushes them sideways, nor what a fault of kind `motion` does to the body
//! behind their back. A holonomic body, which has no sideways, counts every push.

use protocol::{
    frame::BodyVector,
    odometry::{Motion, Odometry},
};

use crate::random::{Draws, Purpose};
use scenario::Scenario;

/// The odometry of all robots.
#[derive(Clone, Debug)]
pub struct Odometers {
    seed: u64,
    /// Standard deviation of each displacement and turn of a tick, as a share of it.
    error: f64,
    /// Motion that each robot's odometry counted in the last tick.
    counted: Vec<Motion>,
    readings: Vec<Odometry>,
}

impl Odometers {
    /// Odometry of robots whose lives begin here; `None` if the scenario grants none.
    pub fn new(scenario: &Scenario) -> Option<Self> {
        let robots = scenario.robot_count() as usize;
        scenario.sensors.odometry.map(|odometry| Self {
            seed: scenario.seed.get(),
            error: odometry.error.get(),
            counted: vec![Motion::NONE; robots],
            readings: vec![Odometry::default(); robots],
        })
    }

    /// Begins a new life: the robot counts from where it is.
    pub fn restart(&mut self, robot: usize) {
        self.readings[robot] = Odometry::default();
    }

    /// Counts what the wheels of each robot `rolled` in tick `tick`.
    pub fn count(&mut self, tick: u64, rolled: &[Motion]) {
        for (robot, (&rolled, reading)) in rolled.iter().zip(&mut self.readings).enumerate() {
            let counted = misjudged(rolled, self.error, || {
                Draws::of(self.seed, Purpose::Odometry, tick, robot as u32, 0)
            });
            self.counted[robot] = counted;
            *reading = reading.after(&counted);
        }
    }

    /// Returns the motion that each robot's odometry counted in the last tick.
    pub fn counted(&self) -> &[Motion] {
        &self.counted
    }

    /// Returns the odometry reading of `robot`.
    pub fn reading(&self, robot: usize) -> Odometry {
        self.readings[robot]
    }
}

/// A motion with an error of its displacement and one of its turn, each a share of it.
fn misjudged(motion: Motion, error: f64, draws: impl FnOnce() -> Draws) -> Motion {
    if error == 0.0 || motion == Motion::NONE {
        return motion;
    }
    let mut draws = draws();
    let mut scale = || 1.0 + error * draws.normal();
    let displacement = BodyVector(motion.displacement.0 * scale());
    Motion { displacement, turn: motion.turn * scale() }
}

#[cfg(test)]
mod tests {
    use protocol::units::wrapped;

    use super::*;

    fn odometers(error: f64) -> Odometers {
        Odometers { seed: 7, error, counted: vec![Motion::NONE], readings: vec![Odometry::default()] }
    }

    #[test]
    fn errors_have_the_spread_that_was_asked_for_and_do_not_go_together() {
        let mut odometers = odometers(0.1);
        let rolled = Motion { displacement: BodyVector::new(0.3, 0.4), turn: -0.2 };
        let ticks = 20_000;
        let (mut way, mut turn, mut both) = (0.0, 0.0, 0.0);
        for tick in 0..ticks {
            odometers.count(tick, &[rolled]);
            let counted = odometers.counted()[0];
            let off =
                [counted.displacement.0.dot(&rolled.displacement.0) / 0.25 - 1.0, counted.turn / -0.2 - 1.0];
            way += off[0] * off[0] / ticks as f64;
            turn += off[1] * off[1] / ticks as f64;
            both += off[0] * off[1] / ticks as f64;
        }
        // Four standard errors of a standard deviation from 20,000 draws are 2 %; of their product's mean, .028 of .01.
        assert!((way.sqrt() / 0.1 - 1.0).abs() < 0.02, "{}", way.sqrt());
        assert!((turn.sqrt() / 0.1 - 1.0).abs() < 0.02, "{}", turn.sqrt());
        assert!(both.abs() < 0.00029, "{both}");
    }

    #[test]
    fn without_an_error_a_reading_is_the_sum_of_what_was_rolled_and_a_new_life_counts_anew() {
        let mut odometers = odometers(0.0);
        // Four sides of a square, counter-clockwise.
        let side = Motion { displacement: BodyVector::new(1.0, 0.0), turn: std::f64::consts::FRAC_PI_2 };
        for tick in 0..3 {
            odometers.count(tick, &[side]);
        }
        assert!((odometers.reading(0).position.0 - BodyVector::new(0.0, 1.0).0).norm() < 1e-15);
        odometers.count(3, &[side]);
        assert!(odometers.reading(0).position.length() < 1e-15);
        assert!(wrapped(odometers.reading(0).heading.get()).abs() < 1e-15);
        odometers.restart(0);
        assert_eq!(odometers.reading(0), Odometry::default());
    }
}

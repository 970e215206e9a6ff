//! When robots transmit: one packet per neighbor cycle, at a time that depends on the scheme.
//!
//! Times are seconds since tick 0; cycles begin before it, so that at tick 0 robots have been
//! talking for a whole cycle already. Where cycles run free, they are as long as each robot's own clock has them;
//! cycles that all robots share are of one length, whatever their clocks are like.

use protocol::{oscillator::Oscillator, robot_id::RobotId};

use crate::random::{Draws, Purpose};
use scenario::{Access, NonNegative, Scenario};

/// Cycles before tick 0 that are numbered: the first packets begin in the second of them.
const CYCLES_BEFORE: u64 = 2;

/// A scheme with its parameters.
#[derive(Clone, Debug)]
pub(super) struct Schedule {
    access: Access,
    cycle_s: f64,
    /// Bound on the drift of the robots' own clocks; 0 where they share a cycle.
    drift_ppm: f64,
    seed: u64,
}

/// A robot's cycles: how long they are, and where they begin.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Rhythm {
    /// The life whose clock it is.
    incarnation: u16,
    cycle_s: f64,
    /// A packet, and when the cycle in which it is sent begins, but for the phase.
    anchor: (u64, f64),
    /// By how much later the robot's own cycles begin.
    phase_s: f64,
}

impl Rhythm {
    /// The life whose clock it is.
    pub(super) fn incarnation(&self) -> u16 {
        self.incarnation
    }

    /// When the cycle of packet `number` begins, but for the phase.
    fn begins_s(&self, number: u64) -> f64 {
        let (anchor, begins_s) = self.anchor;
        begins_s + (number as f64 - anchor as f64) * self.cycle_s
    }
}

impl Schedule {
    pub(super) fn new(access: Access, scenario: &Scenario) -> Self {
        let runs_free = matches!(access, Access::Random { .. } | Access::FixedPhase { .. });
        Self {
            access,
            cycle_s: scenario.cycle_s(),
            drift_ppm: if runs_free { scenario.processes.clock_drift_ppm.get() } else { 0.0 },
            seed: scenario.seed.get(),
        }
    }

    /// Whether each robot sends by a clock of its own.
    pub(super) fn has_own_clocks(&self) -> bool {
        self.drift_ppm > 0.0
    }

    /// The rhythm of a robot's first life.
    pub(super) fn first_rhythm(&self, sender: u32) -> Rhythm {
        let cycle_s = self.own_cycle_s(RobotId::first(sender));
        let phase_s = cycle_s * Draws::of(self.seed, Purpose::Phase, 0, sender, 0).unit();
        // The channel begins its work a cycle before tick 0; own clocks agree there, whatever they are like.
        let anchor = match self.has_own_clocks() {
            true => (CYCLES_BEFORE - 1, -self.cycle_s),
            false => (CYCLES_BEFORE, 0.0),
        };
        Rhythm { incarnation: 0, cycle_s, anchor, phase_s }
    }

    /// The rhythm of the life `id`, which follows `before`, from packet `number` on. Its first cycle begins where it
    /// would have, so that packets neither overtake those before nor overlap with them.
    pub(super) fn next_rhythm(&self, before: &Rhythm, id: RobotId, number: u64) -> Rhythm {
        Rhythm {
            incarnation: id.incarnation,
            cycle_s: self.own_cycle_s(id),
            anchor: (number, before.begins_s(number)),
            phase_s: before.phase_s,
        }
    }

    /// When packet `number` of `sender` begins. Later numbers begin later.
    pub(super) fn start_s(&self, rhythm: &Rhythm, sender: u32, number: u64) -> f64 {
        let mut draws = Draws::of(self.seed, Purpose::Transmission, number, sender, 0);
        let mut within = |guard_s: NonNegative| (rhythm.cycle_s - guard_s.get()) * draws.unit();
        let begins_s = rhythm.begins_s(number);
        match self.access {
            Access::Random { guard_s } => begins_s + (rhythm.phase_s + within(guard_s)),
            Access::Aligned { guard_s } => begins_s + within(guard_s),
            Access::Slotted { slots } => {
                let slot = draws.below(slots.get());
                begins_s + rhythm.cycle_s * (f64::from(slot) / f64::from(slots.get()))
            }
            Access::FixedPhase { jitter_s } => {
                begins_s + (rhythm.phase_s + jitter_s.get() * (draws.unit() - 0.5))
            }
        }
    }

    fn own_cycle_s(&self, id: RobotId) -> f64 {
        match self.has_own_clocks() {
            true => self.cycle_s * (1.0 + Oscillator::of(id, self.seed, self.drift_ppm).drift()),
            false => self.cycle_s,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::num::NonZeroU32;

    use super::*;

    const AIRTIME_S: f64 = 0.01;

    fn seconds(value: f64) -> NonNegative {
        NonNegative::new(value).unwrap()
    }

    fn random() -> Access {
        Access::Random { guard_s: seconds(AIRTIME_S) }
    }

    fn fixed_phase(jitter_s: f64) -> Access {
        Access::FixedPhase { jitter_s: seconds(jitter_s) }
    }

    fn schedule(access: Access, drift_ppm: f64) -> Schedule {
        Schedule { access, cycle_s: 0.25, drift_ppm, seed: 3 }
    }

    #[test]
    fn even_clocks_send_as_if_there_were_none() {
        let aligned = Access::Aligned { guard_s: seconds(AIRTIME_S) };
        let slotted = Access::Slotted { slots: NonZeroU32::new(10).unwrap() };
        for access in [random(), aligned, slotted, fixed_phase(0.2)] {
            let schedule = schedule(access, 0.0);
            let window_s = 0.25 - AIRTIME_S;
            for (sender, number) in (0..20).flat_map(|sender| (0..50).map(move |number| (sender, number))) {
                let phase_s = 0.25 * Draws::of(3, Purpose::Phase, 0, sender, 0).unit();
                let mut draws = Draws::of(3, Purpose::Transmission, number, sender, 0);
                let within_s = match access {
                    Access::Random { .. } => phase_s + window_s * draws.unit(),
                    Access::Aligned { .. } => window_s * draws.unit(),
                    Access::Slotted { .. } => 0.25 * (f64::from(draws.below(10)) / 10.0),
                    Access::FixedPhase { .. } => phase_s + 0.2 * (draws.unit() - 0.5),
                };
                let start_s = schedule.start_s(&schedule.first_rhythm(sender), sender, number);
                assert_eq!(start_s.to_bits(), ((number as f64 - 2.0) * 0.25 + within_s).to_bits());
            }
        }
    }

    #[test]
    fn cycles_are_as_long_as_the_clock_of_each_life_has_them() {
        let schedule = schedule(fixed_phase(0.0), 1000.0);
        let mut rhythm = schedule.first_rhythm(4);
        let period_s = |rhythm: &Rhythm| schedule.start_s(rhythm, 4, 101) - schedule.start_s(rhythm, 4, 100);
        let mut id = RobotId::first(4);
        let mut periods = Vec::new();
        for _ in 0..3 {
            let drift = Oscillator::of(id, 3, 1000.0).drift();
            assert!((period_s(&rhythm) - 0.25 * (1.0 + drift)).abs() < 1e-12);
            periods.push(period_s(&rhythm));
            id = id.reborn();
            rhythm = schedule.next_rhythm(&rhythm, id, 50);
        }
        assert!(periods[0] != periods[1] && periods[1] != periods[2], "a restarted robot has another clock");
    }

    #[test]
    fn later_packets_begin_later_across_restarts_and_never_overlap() {
        // A tenth of all time, the most that a scenario may ask for, and jitter that just fits.
        for access in [random(), fixed_phase(0.2)] {
            let schedule = schedule(access, 1e5);
            for sender in 0..200 {
                let (mut rhythm, mut id) = (schedule.first_rhythm(sender), RobotId::first(sender));
                let mut last_s = f64::NEG_INFINITY;
                for number in 0..200 {
                    if number % 7 == 6 {
                        id = id.reborn();
                        rhythm = schedule.next_rhythm(&rhythm, id, number);
                    }
                    let start_s = schedule.start_s(&rhythm, sender, number);
                    assert!(start_s - last_s > AIRTIME_S - 1e-9, "{access:?} {sender} {number}");
                    last_s = start_s;
                }
            }
        }
    }

    #[test]
    fn shared_cycles_stay_shared() {
        let text = |access: &str| {
            format!(
                "duration_s = 10\nstep_s = 0.25\narena.size_m = [1, 1]\nrobots.count = 2\n\
                 controller.gain_per_s = 1\nchannel = {{ profile = \"isis\", access = \"{access}\" }}\n\
                 processes.clock_drift_ppm = 100"
            )
        };
        for (access, own) in [("random", true), ("fixed-phase", true), ("aligned", false), ("slotted", false)]
        {
            let scenario = Scenario::parse("test", &text(access), &[]).unwrap();
            let access_by = scenario.channel.air().unwrap().access;
            assert_eq!(Schedule::new(access_by, &scenario).has_own_clocks(), own, "{access}");
        }
    }
}

//! Measurement of a sender by a receiver's infrared ring: range, bearing, orientation, all in the
//! receiver's body frame, with the noise and the steps of a real ring.

use protocol::{
    packet::Packet,
    percept::Delivery,
    units::{Meters, Radians, wrapped},
};

use crate::{frame::Pose, random::Draws};
use scenario::ChannelSpec;

/// How well a ring measures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measurement {
    /// Standard deviation of a range, as a share of it.
    sigma_range: f64,
    sigma_bearing_rad: f64,
    sigma_orientation_rad: f64,
    /// Steps in which values are told apart; 0 for none.
    range_step_m: f64,
    bearing_step_rad: f64,
    orientation_step_rad: f64,
}

impl Measurement {
    /// The measurement of a channel.
    pub fn new(channel: &ChannelSpec) -> Self {
        Self {
            sigma_range: channel.sigma_range.get(),
            sigma_bearing_rad: channel.sigma_bearing_deg.get().to_radians(),
            sigma_orientation_rad: channel.sigma_orientation_deg.get().to_radians(),
            range_step_m: channel.range_step_m.get(),
            bearing_step_rad: channel.bearing_step_deg.get().to_radians(),
            orientation_step_rad: channel.orientation_step_deg.get().to_radians(),
        }
    }

    /// `packet` as a robot at `receiver` hears it from one at `sender`. `draws` are asked only if
    /// there is noise.
    #[inline]
    pub fn of(
        &self,
        packet: Packet,
        sender: &Pose,
        receiver: &Pose,
        draws: impl FnOnce() -> Draws,
    ) -> Delivery {
        let away = sender.position - receiver.position;
        let mut range_m = libm::hypot(away.x, away.y);
        let mut bearing = libm::atan2(away.y, away.x) - receiver.heading;
        let mut orientation = sender.heading - receiver.heading;
        if self.is_noisy() {
            let mut draws = draws();
            range_m = (range_m * (1.0 + self.sigma_range * draws.normal())).max(0.0);
            bearing += self.sigma_bearing_rad * draws.normal();
            orientation += self.sigma_orientation_rad * draws.normal();
        }
        Delivery {
            packet,
            range: Meters::new(middle_of_step(range_m, self.range_step_m)).expect("poses are finite"),
            bearing: radians(nearest_step(bearing, self.bearing_step_rad)),
            orientation: radians(nearest_step(orientation, self.orientation_step_rad)),
        }
    }

    fn is_noisy(&self) -> bool {
        self.sigma_range > 0.0 || self.sigma_bearing_rad > 0.0 || self.sigma_orientation_rad > 0.0
    }
}

/// Levels of power tell in which step a sender is; its middle is the best guess.
fn middle_of_step(value: f64, step: f64) -> f64 {
    if step > 0.0 { (libm::floor(value / step) + 0.5) * step } else { value }
}

fn nearest_step(angle: f64, step: f64) -> f64 {
    if step > 0.0 { libm::round(wrapped(angle) / step) * step } else { angle }
}

fn radians(angle: f64) -> Radians {
    Radians::new(wrapped(angle)).expect("poses are finite")
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use protocol::robot_id::RobotId;

    use super::*;
    use crate::{frame::ArenaPoint, random::Purpose};

    const EXACT: Measurement = Measurement {
        sigma_range: 0.0,
        sigma_bearing_rad: 0.0,
        sigma_orientation_rad: 0.0,
        range_step_m: 0.0,
        bearing_step_rad: 0.0,
        orientation_step_rad: 0.0,
    };

    fn heard(measurement: Measurement, draw: u64) -> Delivery {
        let packet = Packet::short(RobotId::first(1), 0, None);
        let receiver = Pose { position: ArenaPoint::new(1.0, 1.0), heading: PI / 2.0 };
        let sender = Pose { position: ArenaPoint::new(1.0, 0.5), heading: -PI / 2.0 };
        measurement.of(packet, &sender, &receiver, || Draws::of(1, Purpose::Measurement, draw, 1, 0))
    }

    #[test]
    fn a_sender_behind_and_facing_away_is_measured_so() {
        let heard = heard(EXACT, 0);
        assert!((heard.range.get() - 0.5).abs() < 1e-15);
        assert!((heard.bearing.get().abs() - PI).abs() < 1e-15);
        assert!((heard.orientation.get().abs() - PI).abs() < 1e-15);
    }

    #[test]
    fn noise_has_the_spread_that_was_asked_for() {
        let noisy = Measurement { sigma_range: 0.1, sigma_bearing_rad: 0.05, ..EXACT };
        let square = |value: f64| value * value;
        let (mut range, mut bearing) = (0.0, 0.0);
        for draw in 0..4000 {
            let heard = heard(noisy, draw);
            range += square(heard.range.get() - 0.5) / 4000.0;
            bearing += square(wrapped(heard.bearing.get() - PI)) / 4000.0;
        }
        // Four standard errors of a standard deviation from 4000 draws are 4.5 %.
        assert!((range.sqrt() / 0.05 - 1.0).abs() < 0.045, "{}", range.sqrt());
        assert!((bearing.sqrt() / 0.05 - 1.0).abs() < 0.045, "{}", bearing.sqrt());
    }

    #[test]
    fn steps_give_the_middle_of_a_range_and_the_nearest_angle() {
        let stepped = Measurement { range_step_m: 0.27, bearing_step_rad: 0.4, ..EXACT };
        let heard = heard(stepped, 0);
        assert!((heard.range.get() - 0.405).abs() < 1e-15);
        // ±π lies between ±2.8 and ±3.2, nearer to the latter, which is the same as ∓3.08.
        assert!(
            (wrapped(heard.bearing.get() - 3.2).abs()).min(wrapped(heard.bearing.get() + 3.2).abs()) < 1e-12
        );
    }
}

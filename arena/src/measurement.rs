//! What a receiver's infrared ring measures of a sender: range, bearing, orientation, all in the
//! receiver's body frame.

use protocol::{
    packet::Packet,
    percept::Delivery,
    units::{Meters, Radians, wrapped},
};

use crate::frame::Pose;

/// `packet` as a robot at `receiver` hears it from one at `sender`.
pub fn measured(packet: Packet, sender: &Pose, receiver: &Pose) -> Delivery {
    let away = sender.position - receiver.position;
    let bearing = libm::atan2(away.y, away.x) - receiver.heading;
    Delivery {
        packet,
        range: Meters::new(libm::hypot(away.x, away.y)).expect("poses are finite"),
        bearing: radians(bearing),
        orientation: radians(sender.heading - receiver.heading),
    }
}

fn radians(angle: f64) -> Radians {
    Radians::new(wrapped(angle)).expect("poses are finite")
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use protocol::robot_id::RobotId;

    use super::*;
    use crate::frame::ArenaPoint;

    #[test]
    fn a_sender_behind_and_facing_away_is_measured_so() {
        let packet = Packet { sender: RobotId::first(1), sequence: 0, light: 0.0 };
        let receiver = Pose { position: ArenaPoint::new(1.0, 1.0), heading: PI / 2.0 };
        let sender = Pose { position: ArenaPoint::new(1.0, 0.5), heading: -PI / 2.0 };
        let heard = measured(packet, &sender, &receiver);
        assert!((heard.range.get() - 0.5).abs() < 1e-15);
        assert!((heard.bearing.get().abs() - PI).abs() < 1e-15);
        assert!((heard.orientation.get().abs() - PI).abs() < 1e-15);
    }
}

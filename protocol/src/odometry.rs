//! Odometry: a robot's own motion as its wheels believe it.
//!
//! In:  two readings of one life.
//! Out: the [`Motion`] between them, and where a neighbor heard before it is after it, in the body frame of now.
//!
//! A reading counts from the beginning of the robot's life, in the body frame that it had then. So a reading that is
//! lost or taken in twice does no harm, and none says where in the arena a robot is or which way it faces.

use crate::{
    delivery::Delivery,
    frame::BodyVector,
    units::{Meters, Radians, wrapped},
};

/// How a robot has moved since its life began, in the body frame that it had then.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Odometry {
    /// Where it is now.
    pub position: BodyVector,
    /// Which way it faces now, in (-π, π].
    pub heading: Radians,
}

/// A displacement and a turn: from one body frame to the next.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Motion {
    /// How far the body came, in the frame before, meters.
    pub displacement: BodyVector,
    /// By how much it turned, radians, counter-clockwise.
    pub turn: f64,
}

impl Odometry {
    /// The motion from an earlier reading of the same life to this one.
    pub fn since(&self, earlier: &Self) -> Motion {
        let way = BodyVector(self.position.0 - earlier.position.0);
        Motion {
            displacement: way.turned(-earlier.heading.get()),
            turn: wrapped(self.heading.get() - earlier.heading.get()),
        }
    }

    /// The reading after one more motion.
    pub fn after(&self, motion: &Motion) -> Self {
        let way = motion.displacement.turned(self.heading.get());
        Self {
            position: BodyVector(self.position.0 + way.0),
            heading: angle(self.heading.get() + motion.turn),
        }
    }
}

impl Motion {
    /// No motion at all.
    pub const NONE: Self = Self { displacement: BodyVector::HERE, turn: 0.0 };

    /// Where the sender of `delivery`, heard before this motion, is after it if it has not moved itself.
    pub fn carry_along(&self, delivery: &mut Delivery) {
        if *self == Self::NONE {
            return;
        }
        let mut bearing = delivery.bearing.get();
        if self.displacement != BodyVector::HERE {
            let sender = BodyVector::polar(delivery.range, delivery.bearing);
            let away = BodyVector(sender.0 - self.displacement.0);
            delivery.range = Meters::new(away.length().min(f64::MAX)).expect("it is bounded");
            bearing = away.bearing();
        }
        delivery.bearing = angle(bearing - self.turn);
        delivery.orientation = angle(delivery.orientation.get() - self.turn);
    }
}

/// An angle in (-π, π].
fn angle(radians: f64) -> Radians {
    Radians::new(wrapped(radians)).expect("a sum of two finite angles")
}

#[cfg(test)]
mod tests {
    use core::f64::consts::{FRAC_PI_2, PI};

    use proptest::prelude::*;

    use super::*;
    use crate::{packet::Packet, robot_id::RobotId};

    fn heard(range: f64, bearing: f64) -> Delivery {
        Delivery {
            packet: Packet::short(RobotId::first(1), 0, None),
            range: Meters::new(range).unwrap(),
            bearing: Radians::new(bearing).unwrap(),
            orientation: Radians::new(0.5).unwrap(),
        }
    }

    fn motion(ahead: f64, left: f64, turn: f64) -> Motion {
        Motion { displacement: BodyVector::new(ahead, left), turn }
    }

    #[test]
    fn a_neighbor_of_a_robot_that_turns_in_place_turns_the_other_way() {
        let mut delivery = heard(0.7, 3.0);
        motion(0.0, 0.0, -1.0).carry_along(&mut delivery);
        assert_eq!(delivery.range.get(), 0.7);
        assert!((delivery.bearing.get() - (4.0 - 2.0 * PI)).abs() < 1e-15, "angles stay in one turn");
        assert_eq!(delivery.orientation.get(), 1.5);
    }

    #[test]
    fn a_neighbor_abeam_of_a_robot_that_drives_on_and_turns_to_it_lies_where_geometry_has_it() {
        let mut delivery = heard(0.4, FRAC_PI_2);
        motion(0.3, 0.0, FRAC_PI_2).carry_along(&mut delivery);
        assert!((delivery.range.get() - 0.5).abs() < 1e-15);
        assert!((delivery.bearing.get() - libm::atan2(0.3, 0.4)).abs() < 1e-15);
    }

    #[test]
    fn a_robot_that_stands_still_keeps_every_bit() {
        let mut delivery = heard(0.1, -0.3);
        let here = Odometry::default().after(&motion(0.1, 0.2, 3.0));
        here.since(&here).carry_along(&mut delivery);
        assert_eq!(delivery, heard(0.1, -0.3));
    }

    #[test]
    fn readings_as_far_apart_as_a_percept_may_carry_them_move_a_neighbor_somewhere() {
        let reading = |x: f64, heading: f64| Odometry {
            position: BodyVector::new(x, -x),
            heading: Radians::new(heading).unwrap(),
        };
        for range in [0.0, 1.0, f64::MAX] {
            let mut delivery = heard(range, 1e308);
            reading(1e12, -1e12).since(&reading(-1e12, 1e12)).carry_along(&mut delivery);
            assert!(delivery.range.get() >= 0.0 && delivery.bearing.get().is_finite());
        }
    }

    proptest! {
        #[test]
        fn readings_lost_on_the_way_change_nothing(
            steps in proptest::collection::vec((-1.0_f64..1.0, -1.0_f64..1.0, -3.0_f64..3.0), 1..10),
            range in 0.0_f64..3.0, bearing in -3.0_f64..3.0,
        ) {
            let (mut by_steps, mut at_once) = (heard(range, bearing), heard(range, bearing));
            let start = Odometry::default().after(&motion(5.0, -2.0, 1.0));
            let mut now = start;
            for &(ahead, left, turn) in &steps {
                now = now.after(&motion(ahead, left, turn));
                motion(ahead, left, turn).carry_along(&mut by_steps);
            }
            now.since(&start).carry_along(&mut at_once);
            let place = |delivery: &Delivery| BodyVector::polar(delivery.range, delivery.bearing).0;
            prop_assert!((place(&by_steps) - place(&at_once)).norm() < 1e-12);
            let turned = wrapped(by_steps.orientation.get() - at_once.orientation.get());
            prop_assert!(turned.abs() < 1e-12);
        }
    }
}

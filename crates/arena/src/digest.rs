//! The digest: what happened in a run, in 128 bits.
//!
//! A hash over each tick's robot ids, the bits of their poses, and the ids of the packets they
//! heard; of packets of users' own controllers also what they say, since nothing else may show it. Two runs with equal
//! digests were the same run; lock-step processes and the in-process engine must agree on it.

use protocol::{
    percept::{Delivery, Percept, Tick},
    robot_id::RobotId,
};
use twox_hash::{XxHash3_64, XxHash3_128};

use crate::frame::Pose;

/// A digest in the making.
#[derive(Clone)]
pub struct Digest {
    hasher: XxHash3_128,
    /// One robot's tick, on its way: the hasher takes many bytes at once faster than a few many times.
    bytes: Vec<u8>,
}

impl Default for Digest {
    fn default() -> Self {
        Self { hasher: XxHash3_128::new(), bytes: Vec::new() }
    }
}

/// One robot's tick, as far as it counts.
#[derive(Clone, Copy, Debug)]
pub struct RobotTick<'a> {
    /// The tick.
    pub tick: Tick,
    /// The robot, with its life.
    pub robot: RobotId,
    /// Where it is.
    pub pose: &'a Pose,
    /// The percept that it was handed, if it was handed one.
    pub percept: Option<&'a Percept>,
    /// Robots, by index, of whose packets counts what they say; empty if of nobody's.
    pub says_own: &'a [bool],
}

impl Digest {
    /// Takes in one robot's tick. Robots come in the order of their indices.
    #[inline]
    pub fn record(&mut self, robot: RobotTick<'_>) {
        self.write(robot);
        self.hasher.write(&self.bytes);
        self.bytes.clear();
    }

    /// One robot's tick alone, as a number: it tells where two runs part.
    pub fn of_robot(&mut self, robot: RobotTick<'_>) -> u64 {
        self.write(robot);
        let hash = XxHash3_64::oneshot(&self.bytes);
        self.bytes.clear();
        hash
    }

    #[inline]
    fn write(&mut self, RobotTick { tick, robot, pose, percept, says_own }: RobotTick<'_>) {
        let place = [pose.position.x, pose.position.y, pose.heading].map(f64::to_bits);
        let heard = percept.map_or(0, |percept| percept.deliveries.len() as u64);
        self.numbers([tick, number_of(robot), place[0], place[1], place[2], heard]);
        let Some(percept) = percept else { return };
        if says_own.is_empty() {
            percept.deliveries.iter().for_each(|delivery| self.packet(delivery));
            return;
        }
        for delivery in &percept.deliveries {
            self.packet(delivery);
            if says_own.get(delivery.packet.sender().index as usize) == Some(&true) {
                let payload = percept.payload(delivery);
                self.numbers([payload.len() as u64]);
                self.bytes.extend_from_slice(payload);
            }
        }
    }

    #[inline]
    fn packet(&mut self, delivery: &Delivery) {
        self.numbers([number_of(delivery.packet.sender()), delivery.packet.sequence().into()]);
    }

    /// The digest so far, as 32 hexadecimal digits.
    pub fn hex(&self) -> String {
        format!("{:032x}", self.hasher.finish_128())
    }

    /// All at once: their bytes are copied in as many registers, where one by one they are as many calls.
    #[inline]
    fn numbers<const N: usize>(&mut self, numbers: [u64; N]) {
        self.bytes.extend_from_slice(numbers.map(u64::to_le_bytes).as_flattened());
    }
}

fn number_of(robot: RobotId) -> u64 {
    u64::from(robot.index) << 16 | u64::from(robot.incarnation)
}

impl std::fmt::Debug for Digest {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Digest({})", self.hex())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::ArenaPoint;

    fn digest(x: f64, robot: RobotId) -> String {
        let mut digest = Digest::default();
        let pose = &Pose::unturned(ArenaPoint::new(x, 0.0));
        digest.record(RobotTick { tick: 0, robot, pose, percept: None, says_own: &[] });
        digest.hex()
    }

    #[test]
    fn the_last_bit_of_a_pose_and_the_life_of_a_robot_count() {
        let robot = RobotId::first(0);
        assert_eq!(digest(1.0, robot), digest(1.0, robot));
        assert_ne!(digest(1.0, robot), digest(1.0 + f64::EPSILON, robot));
        assert_ne!(digest(1.0, robot), digest(1.0, robot.reborn()));
        assert_eq!(digest(1.0, robot).len(), 32);
    }
}

//! How long carrying a packet takes beyond what is modeled.
//!
//! A packet's way has two parts that are ours: from the sender's publishing until the arena takes its answer in, and
//! from the arena's handing out of percepts until the receiver has read its own. What lies between is the arena's
//! work, the modeled air time and the wait for the next neighbor cycle, and does not count. The first part is one per
//! packet, the second one per percept.

use protocol::{packet::Packet, robot_id::RobotId};

/// Packets of one sender that are remembered: the one that is in the air, and a few that faults delay.
const REMEMBERED: usize = 4;

/// First parts, nanoseconds, of the packets that each robot has sent last.
#[derive(Debug)]
pub(super) struct Origins {
    /// The last one: nearly all that is asked for, and small enough for the nearest cache.
    latest: Vec<Option<Origin>>,
    /// Those before it, and it too.
    recent: Vec<[Option<Origin>; REMEMBERED]>,
}

#[derive(Clone, Copy, Debug)]
struct Origin {
    sequence: u32,
    first_ns: u32,
    incarnation: u16,
}

impl Origins {
    pub(super) fn new(robots: usize) -> Self {
        Self { latest: vec![None; robots], recent: vec![[None; REMEMBERED]; robots] }
    }

    /// The arena has taken in a command with `packet`; its first part took `first_ns`.
    pub(super) fn note(&mut self, packet: &Packet, first_ns: u32) {
        let RobotId { index, incarnation } = packet.sender;
        let (sequence, index) = (packet.sequence, index as usize);
        let origin = Some(Origin { sequence, first_ns, incarnation });
        self.latest[index] = origin;
        self.recent[index][sequence as usize % REMEMBERED] = origin;
    }

    /// First part of a packet, if it is known: a first word, a packet delayed for long, or one in a false name
    /// has none.
    #[inline]
    pub(super) fn of(&self, packet: &Packet) -> Option<u32> {
        let index = packet.sender.index as usize;
        let first_ns = |origin: &Option<Origin>| {
            let Origin { sequence, first_ns, incarnation } = (*origin)?;
            let is_it = sequence == packet.sequence && incarnation == packet.sender.incarnation;
            is_it.then_some(first_ns)
        };
        let recent = || first_ns(&self.recent[index][packet.sequence as usize % REMEMBERED]);
        first_ns(self.latest.get(index)?).or_else(recent)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn packet(index: u32, incarnation: u16, sequence: u32) -> Packet {
        Packet { sender: RobotId { index, incarnation }, sequence, light: 0.0 }
    }

    #[test]
    fn a_packet_is_known_by_sender_life_and_number() {
        let mut origins = Origins::new(2);
        origins.note(&packet(1, 0, 7), 70);
        origins.note(&packet(1, 0, 8), 80);
        assert_eq!(origins.of(&packet(1, 0, 7)), Some(70));
        assert_eq!(origins.of(&packet(1, 0, 8)), Some(80));
        for unknown in [packet(1, 0, 6), packet(1, 0, 11), packet(0, 0, 7), packet(1, 1, 7), packet(9, 0, 7)]
        {
            assert_eq!(origins.of(&unknown), None, "{unknown:?}");
        }
        origins.note(&packet(1, 1, 0), 5);
        assert_eq!(origins.of(&packet(1, 1, 0)), Some(5));
        assert_eq!(origins.of(&packet(1, 1, 8)), None, "that is of another life");
        origins.note(&packet(1, 1, 4), 6);
        assert_eq!(origins.of(&packet(1, 1, 0)), None, "so many packets later it is forgotten");
    }
}

//! How long carrying a packet takes beyond what is modeled.
//!
//! A packet's way has two parts that are ours: from the sender's publishing until the arena takes its answer in, and
//! from the arena's handing out of percepts until the receiver has read its own. What lies between is the arena's
//! work, the modeled air time and the wait for the next neighbor cycle, and does not count. The first part is one per
//! packet, the second one per percept.

use protocol::packet::Packet;

/// Packets of one sender that are remembered: the one that is in the air, and a few that faults delay.
const REMEMBERED: usize = 4;

/// First parts, nanoseconds, of the packets that each robot has sent last.
#[derive(Debug)]
pub(super) struct Origins {
    /// The last one: nearly all that is asked for, and small enough for the nearest cache.
    latest: Vec<Origin>,
    /// The last few, the last one included.
    recent: Vec<[Origin; REMEMBERED]>,
}

#[derive(Clone, Copy, Debug)]
struct Origin {
    number: u64,
    first_ns: u32,
}

impl Origin {
    /// Of no packet.
    const NONE: Self = Self { number: u64::MAX, first_ns: 0 };
}

/// Tells the packets of one robot apart, in all its lives.
fn number(packet: &Packet) -> u64 {
    u64::from(packet.sender().incarnation) << 32 | u64::from(packet.sequence())
}

impl Origins {
    pub(super) fn new(robots: usize) -> Self {
        Self { latest: vec![Origin::NONE; robots], recent: vec![[Origin::NONE; REMEMBERED]; robots] }
    }

    /// The arena has taken in a command with `packet`; its first part took `first_ns`.
    pub(super) fn note(&mut self, packet: &Packet, first_ns: u32) {
        let index = packet.sender().index as usize;
        let origin = Origin { number: number(packet), first_ns };
        self.latest[index] = origin;
        self.recent[index][packet.sequence() as usize % REMEMBERED] = origin;
    }

    /// First part of a packet, if it is known: a first packet, a packet delayed for long, or one in a false name
    /// has none.
    #[inline]
    pub(super) fn of(&self, packet: &Packet) -> Option<u32> {
        let latest = self.latest.get(packet.sender().index as usize)?;
        if latest.number == number(packet) { Some(latest.first_ns) } else { self.before(packet) }
    }

    /// The same of a packet that is not the last one of its sender.
    #[cold]
    fn before(&self, packet: &Packet) -> Option<u32> {
        let recent = self.recent[packet.sender().index as usize][packet.sequence() as usize % REMEMBERED];
        (recent.number == number(packet)).then_some(recent.first_ns)
    }
}

#[cfg(test)]
mod tests {
    use protocol::robot_id::RobotId;

    use super::*;

    fn packet(index: u32, incarnation: u16, sequence: u32) -> Packet {
        Packet::short(RobotId { index, incarnation }, sequence, None)
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

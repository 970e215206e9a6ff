//! Which packet goes from whom to whom, and when: what arrows are made of.
//!
//! When a packet was published is known a cycle later than the packet itself, and so is when its receiver read it.
//! Both are put together once all that has come is known.

use std::collections::VecDeque;

use profile::PacketNumber;
use protocol::{packet::Packet, percept::Tick};

/// Packets of one sender, and percepts of one receiver, that are remembered: more than faults commonly delay.
const REMEMBERED: usize = 16;

/// Packets that one robot has sent and heard of late.
#[derive(Debug, Default)]
pub(super) struct Correspondence {
    /// Its packets, and when publishing each began and ended.
    sent: VecDeque<(PacketNumber, [u64; 2])>,
    heard: VecDeque<(Tick, Vec<(u32, PacketNumber)>)>,
}

/// From sender to receiver.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Arrow {
    /// Index of the sender, and when it sent the packet.
    pub(super) sent: (u32, u64),
    /// Index of the receiver, and when it had read it.
    pub(super) received: (u32, u64),
}

impl Correspondence {
    /// It published `packet` from `begin_ns` to `end_ns`.
    pub(super) fn published(&mut self, packet: PacketNumber, begin_ns: u64, end_ns: u64) {
        if self.sent.len() == REMEMBERED {
            self.sent.pop_front();
        }
        self.sent.push_back((packet, [begin_ns, end_ns]));
    }

    /// It is handed the percept of `tick` with `packets`.
    pub(super) fn hears<'a>(&mut self, tick: Tick, packets: impl Iterator<Item = &'a Packet>) {
        let mut heard = match self.heard.len() {
            REMEMBERED => self.heard.pop_front().map(|oldest| oldest.1).unwrap_or_default(),
            _ => Vec::new(),
        };
        heard.clear();
        heard.extend(packets.map(|packet| (packet.sender().index, PacketNumber::of(packet))));
        self.heard.push_back((tick, heard));
    }

    /// It has read the percept of `tick`: who has sent what is in it. Known once.
    fn read(&mut self, tick: Tick) -> Vec<(u32, PacketNumber)> {
        let heard = self.heard.iter_mut().find(|heard| heard.0 == tick);
        heard.map(|heard| std::mem::take(&mut heard.1)).unwrap_or_default()
    }

    fn published_ns(&self, packet: PacketNumber) -> Option<[u64; 2]> {
        self.sent.iter().find(|(sent, _)| *sent == packet).map(|&(_, published_ns)| published_ns)
    }
}

/// The arrows that end where `receiver` has read the percept of `tick`, at `read_ns`. There is none from whom we know
/// nothing of, and none for a packet that was not sent in a measured cycle: a first packet, one that came too late, or
/// one in a false name.
///
/// An arrow begins within the stage that publishes, a nanosecond before its end: viewers bind it to the slice it lies
/// in. It begins earlier if the receiver was faster than the sender was to stamp the end of its publishing.
pub(super) fn arrows(
    robots: &mut [Option<Correspondence>],
    receiver: u32,
    tick: Tick,
    read_ns: u64,
) -> Vec<Arrow> {
    let heard = robots[receiver as usize].as_mut().map(|receiver| receiver.read(tick)).unwrap_or_default();
    let arrow = |&(sender, number): &(u32, PacketNumber)| {
        let [begin_ns, end_ns] = robots.get(sender as usize)?.as_ref()?.published_ns(number)?;
        let sent_ns = end_ns.saturating_sub(1).min(read_ns).max(begin_ns);
        (sent_ns <= read_ns).then_some(Arrow { sent: (sender, sent_ns), received: (receiver, read_ns) })
    };
    heard.iter().filter_map(arrow).collect()
}

#[cfg(test)]
mod tests {
    use protocol::robot_id::RobotId;

    use super::*;

    fn packet(index: u32, incarnation: u16, sequence: u32) -> Packet {
        Packet::short(RobotId { index, incarnation }, sequence, None)
    }

    #[test]
    fn an_arrow_goes_from_publishing_to_reading_once_both_are_known() {
        let mut robots = [Some(Correspondence::default()), Some(Correspondence::default()), None];
        let sender = robots[0].as_mut().unwrap();
        sender.published(PacketNumber::of(&packet(0, 1, 7)), 100, 200);
        // The second one is not known to be published, the third is another life's, the fourth of nobody traced.
        let heard = [packet(0, 1, 7), packet(0, 1, 8), packet(0, 0, 7), packet(2, 0, 7), packet(9, 0, 7)];
        robots[1].as_mut().unwrap().hears(5, heard.iter());
        assert_eq!(arrows(&mut robots, 1, 4, 900), [], "another percept");
        let expected = Arrow { sent: (0, 199), received: (1, 900) };
        assert_eq!(arrows(&mut robots, 1, 5, 900), [expected]);
        assert_eq!(arrows(&mut robots, 1, 5, 900), [], "once");
    }

    #[test]
    fn no_arrow_goes_back_in_time() {
        let mut robots = [Some(Correspondence::default()), Some(Correspondence::default())];
        robots[0].as_mut().unwrap().published(PacketNumber::of(&packet(0, 0, 1)), 100, 200);
        for (tick, read_ns, expected) in [(1, 150, Some(150)), (2, 100, Some(100)), (3, 99, None)] {
            robots[1].as_mut().unwrap().hears(tick, [packet(0, 0, 1)].iter());
            let arrows = arrows(&mut robots, 1, tick, read_ns);
            assert_eq!(arrows.first().map(|arrow| arrow.sent.1), expected, "read at {read_ns}");
        }
    }

    #[test]
    fn what_is_old_is_forgotten() {
        let mut robots = [Some(Correspondence::default())];
        let robot = robots[0].as_mut().unwrap();
        for tick in 0..=REMEMBERED as u64 {
            robot.published(PacketNumber::of(&packet(0, 0, tick as u32)), 1, 2);
            robot.hears(tick, [packet(0, 0, tick as u32)].iter());
        }
        assert_eq!((robot.sent.len(), robot.heard.len()), (REMEMBERED, REMEMBERED));
        assert_eq!(arrows(&mut robots, 0, 0, 9), []);
        assert_eq!(arrows(&mut robots, 0, 1, 9).len(), 1);
    }
}

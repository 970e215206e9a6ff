//! Packets as frames: handed on as they came, since many robots hear the same one, and encoded only if something on
//! the way has changed them.

use protocol::{
    packet::PacketView,
    percept::{Delivery, Percept},
};

use crate::raw::{RawFrame, RawLongFrame};

/// Frames kept per robot: the newest, and one before it that may still be in the air.
const KEPT: usize = 2;

/// Frames that were sent last, by sender.
#[derive(Clone, Debug, Default)]
pub struct Frames {
    /// By index of the sender, then by number.
    latest: Vec<[KeptFrame; KEPT]>,
    /// The last one in the name of any other, which a liar may choose.
    foreign: KeptFrame,
}

/// A frame as messages hold it.
#[derive(Clone, Copy, Debug, Default)]
pub struct KeptFrame {
    /// The frame, or its beginning.
    pub frame: RawFrame,
    /// The frame, if it is long.
    pub long: RawLongFrame,
}

impl Frames {
    /// Room for so many senders.
    pub fn of(robots: usize) -> Self {
        Self { latest: vec![Default::default(); robots], foreign: KeptFrame::default() }
    }

    /// Keeps the frame in which `packet` has come, for those who will hear it.
    pub fn keep(&mut self, packet: &PacketView<'_>, frame: &[u8]) {
        self.slot(packet).set(frame);
    }

    /// The frame of `packet`.
    #[inline]
    pub fn get(&mut self, packet: &PacketView<'_>) -> &KeptFrame {
        let kept = self.slot(packet);
        if !kept.frame.whole(&kept.long.0).is_ok_and(|frame| packet.is_in(frame)) {
            kept.set(&packet.encode());
        }
        kept
    }

    /// The frame of the packet of one of `percept`'s deliveries.
    #[inline]
    pub fn of_delivery(&mut self, percept: &Percept, delivery: &Delivery) -> &KeptFrame {
        self.get(&delivery.packet.view(percept.payload(delivery)))
    }

    #[inline]
    fn slot(&mut self, packet: &PacketView<'_>) -> &mut KeptFrame {
        match self.latest.get_mut(packet.sender.index as usize) {
            Some(latest) => &mut latest[packet.sequence as usize % KEPT],
            None => &mut self.foreign,
        }
    }
}

impl KeptFrame {
    fn set(&mut self, frame: &[u8]) {
        self.frame = RawFrame::of(frame);
        if self.frame.is_long() {
            self.long = RawLongFrame::of(frame);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol::robot_id::RobotId;

    const ROBOT: RobotId = RobotId { index: 7, incarnation: 2 };

    #[test]
    fn a_frame_is_that_of_the_packet_however_often_it_is_asked_for() {
        let mut frames = Frames::of(8);
        let long = [9; 128];
        let packet = PacketView { sender: ROBOT, sequence: 5, payload: &[1, 2, 3, 4] };
        let others = [
            packet,
            PacketView { sequence: 6, ..packet },
            PacketView { payload: &[1, 2, 3, 5], ..packet },
            PacketView { payload: &[1, 2, 3], ..packet },
            PacketView { payload: &[], ..packet },
            PacketView { payload: &long, ..packet },
            PacketView { payload: &long[1..], ..packet },
            PacketView { sender: RobotId { incarnation: 3, ..ROBOT }, ..packet },
            PacketView { sender: RobotId::first(8), ..packet },
            PacketView { sender: RobotId::first(u32::MAX), payload: &long, ..packet },
        ];
        for packet in others.iter().flat_map(|packet| [packet, packet]) {
            let kept = frames.get(packet);
            assert_eq!(kept.frame.whole(&kept.long.0), Ok(&packet.encode()[..]));
        }
    }

    #[test]
    fn a_frame_that_has_come_is_handed_on_and_not_encoded_again() {
        let mut frames = Frames::of(8);
        let packet = PacketView { sender: ROBOT, sequence: 5, payload: &[1; 40] };
        let mut marked = packet.encode();
        // What a checksum is, only who encodes knows.
        *marked.last_mut().unwrap() ^= 0xff;
        frames.keep(&packet, &marked);
        let next = PacketView { sequence: 6, ..packet };
        frames.keep(&next, &next.encode());
        let kept = frames.get(&packet);
        assert_eq!(kept.frame.whole(&kept.long.0), Ok(&marked[..]));
    }
}

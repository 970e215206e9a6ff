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
#[derive(Clone, Debug)]
pub struct Frames {
    robots: usize,
    /// By index of the sender, then by number. Whoever else a liar may choose to name has the places behind them.
    frames: Vec<RawFrame>,
    /// In the same places all of those that are long. Few runs have any: until one comes, this is empty, and what is
    /// looked up for each delivery stays small.
    long: Vec<RawLongFrame>,
}

/// A frame as messages hold it.
#[derive(Clone, Copy, Debug)]
pub struct KeptFrame<'a> {
    /// The frame, or its beginning.
    pub frame: &'a RawFrame,
    /// The whole of it, if it is long.
    pub long: Option<&'a RawLongFrame>,
}

impl Frames {
    /// Room for so many senders.
    pub fn of(robots: usize) -> Self {
        Self { robots, frames: vec![RawFrame::default(); (robots + 1) * KEPT], long: Vec::new() }
    }

    /// Keeps the frame in which `packet` has come, for those who will hear it. If it is long, `long` begins with it.
    #[inline]
    pub fn keep(&mut self, packet: &PacketView<'_>, frame: &RawFrame, long: &[u8]) {
        let place = self.place(packet);
        self.frames[place] = *frame;
        if frame.is_long() {
            self.keep_long(place, &long[..frame.len.into()]);
        }
    }

    /// The frame of `packet`.
    #[inline]
    pub fn get(&mut self, packet: &PacketView<'_>) -> KeptFrame<'_> {
        let place = self.place(packet);
        match self.frames[place].usual().is_some_and(|frame| packet.is_in(frame)) {
            true => KeptFrame { frame: &self.frames[place], long: None },
            false => self.get_any(place, packet),
        }
    }

    #[inline(never)]
    fn get_any(&mut self, place: usize, packet: &PacketView<'_>) -> KeptFrame<'_> {
        if !self.kept(place).whole().is_some_and(|frame| packet.is_in(frame)) {
            let frame = packet.encode();
            self.frames[place] = RawFrame::of(&frame);
            if self.frames[place].is_long() {
                self.keep_long(place, &frame);
            }
        }
        self.kept(place)
    }

    fn keep_long(&mut self, place: usize, frame: &[u8]) {
        self.long.resize_with(self.frames.len(), RawLongFrame::default);
        self.long[place] = RawLongFrame::of(frame);
    }

    /// The frame of the packet of one of `percept`'s deliveries.
    #[inline]
    pub fn of_delivery(&mut self, percept: &Percept, delivery: &Delivery) -> KeptFrame<'_> {
        self.get(&delivery.packet.view(percept.payload(delivery)))
    }

    #[inline]
    fn place(&self, packet: &PacketView<'_>) -> usize {
        self.robots.min(packet.sender.index as usize) * KEPT + packet.sequence as usize % KEPT
    }

    fn kept(&self, place: usize) -> KeptFrame<'_> {
        let frame = &self.frames[place];
        KeptFrame { frame, long: if frame.is_long() { self.long.get(place) } else { None } }
    }
}

impl KeptFrame<'_> {
    #[inline]
    fn whole(&self) -> Option<&[u8]> {
        self.frame.whole(self.long.map_or(&[], |long| &long.0)).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol::{payload::SHORT_PAYLOAD_BYTES, robot_id::RobotId};

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
            assert_eq!(kept.whole(), Some(&packet.encode()[..]));
            assert_eq!(kept.long.is_some(), packet.payload.len() > SHORT_PAYLOAD_BYTES);
        }
    }

    #[test]
    fn a_frame_that_has_come_is_handed_on_and_not_encoded_again() {
        let mut frames = Frames::of(8);
        let packet = PacketView { sender: ROBOT, sequence: 5, payload: &[1; 40] };
        let mut marked = packet.encode();
        // What a checksum is, only who encodes knows.
        *marked.last_mut().unwrap() ^= 0xff;
        frames.keep(&packet, &RawFrame::of(&marked), &marked);
        let next = PacketView { sequence: 6, ..packet };
        frames.keep(&next, &RawFrame::of(&next.encode()), &next.encode());
        assert_eq!(frames.get(&packet).whole(), Some(&marked[..]));
    }
}

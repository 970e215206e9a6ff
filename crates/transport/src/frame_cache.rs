//! Packets as frames, each encoded once: many robots hear the same one.

use crate::raw::RawFrame;
use protocol::packet::Packet;

/// Frames of the packets that were sent last, one per robot: many hear the same one.
#[derive(Clone, Debug, Default)]
pub struct Frames {
    /// By index of the sender.
    latest: Vec<Option<(Packet, RawFrame)>>,
}

impl Frames {
    /// Room for so many senders. A packet in the name of any other, which a liar may choose, is encoded anew
    /// each time.
    pub fn of(robots: usize) -> Self {
        Self { latest: vec![None; robots] }
    }

    /// The frame of `packet`.
    pub fn get(&mut self, packet: &Packet) -> RawFrame {
        let Some(slot) = self.latest.get_mut(packet.sender.index as usize) else {
            return RawFrame::of(packet);
        };
        match slot {
            Some((latest, frame)) if same_bits(latest, packet) => *frame,
            _ => slot.insert((*packet, RawFrame::of(packet))).1,
        }
    }
}

/// Zero is not minus zero here.
fn same_bits(a: &Packet, b: &Packet) -> bool {
    a.sender == b.sender && a.sequence == b.sequence && a.light.to_bits() == b.light.to_bits()
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol::robot_id::RobotId;

    const ROBOT: RobotId = RobotId { index: 7, incarnation: 2 };

    #[test]
    fn a_frame_is_that_of_the_packet_however_often_it_is_asked_for() {
        let mut frames = Frames::of(8);
        let packet = Packet { sender: ROBOT, sequence: 5, light: 3.5 };
        let others = [
            packet,
            Packet { sequence: 6, ..packet },
            Packet { light: 0.0, ..packet },
            Packet { light: -0.0, ..packet },
            Packet { sender: RobotId { incarnation: 3, ..ROBOT }, ..packet },
            Packet { sender: RobotId::first(8), ..packet },
            Packet { sender: RobotId::first(u32::MAX), ..packet },
        ];
        for packet in others.iter().flat_map(|packet| [packet, packet]) {
            assert_eq!(frames.get(packet), RawFrame::of(packet));
        }
    }
}

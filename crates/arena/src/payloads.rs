//! Payloads of packets on their way: those too long to lie in their packets.
//!
//! A packet is copied to all who hear it, its payload is not: the packet has its place. Places that no packet has any
//! more are found as a garbage collector does, by looking at all packets that are held.

use protocol::{
    packet::{Body, Packet, PacketView},
    payload::Payload,
};

/// As many payloads are kept before anybody looks which are still needed.
const ROOM: usize = 64;

/// The long payloads of all packets that the arena holds.
#[derive(Clone, Debug, Default)]
pub struct Payloads {
    kept: Vec<Payload>,
    /// Places that are free.
    free: Vec<u32>,
    /// Payloads that packets had at the last sweep, and that have come since.
    needed: usize,
    added: usize,
    /// Which places packets have; kept for its memory alone.
    marked: Vec<bool>,
}

impl Payloads {
    /// The packet that `view` shows.
    pub fn packet(&mut self, view: &PacketView<'_>) -> Packet {
        Packet::of(view, |payload| self.keep(payload))
    }

    /// The payload of a packet that the arena holds.
    pub fn of<'a>(&'a self, packet: &'a Packet) -> &'a [u8] {
        match packet.body() {
            Body::Inline(payload) => payload,
            Body::Beside { place, len } => &self.kept[place as usize][..len],
        }
    }

    /// Whether there are none, and never were.
    pub fn is_unused(&self) -> bool {
        self.kept.is_empty()
    }

    /// Places that there are, in use or free.
    pub fn places(&self) -> usize {
        self.kept.len()
    }

    /// Whether it is time for a [`sweep`](Self::sweep): as many payloads have come as were needed at the last one. So
    /// places are at most twice as many as payloads under way, and a payload costs a bounded share of a sweep.
    pub fn is_full(&self) -> bool {
        self.added > self.needed.max(ROOM)
    }

    /// Frees the places that none of `held` has, which must be all packets that the arena holds.
    pub fn sweep<'a>(&mut self, held: impl Iterator<Item = &'a Packet>) {
        self.marked.clear();
        self.marked.resize(self.kept.len(), false);
        for packet in held {
            if let Body::Beside { place, .. } = packet.body() {
                self.marked[place as usize] = true;
            }
        }
        self.free.clear();
        self.free.extend((0..).zip(&self.marked).filter(|(_, marked)| !**marked).map(|(place, _)| place));
        (self.needed, self.added) = (self.kept.len() - self.free.len(), 0);
    }

    fn keep(&mut self, payload: &[u8]) -> u32 {
        let payload = Payload::try_from(payload).expect("a packet's payload is no longer than any packet's");
        self.added += 1;
        match self.free.pop() {
            Some(place) => {
                self.kept[place as usize] = payload;
                place
            }
            None => {
                self.kept.push(payload);
                self.kept.len() as u32 - 1
            }
        }
    }
}

//! The infrared packet: what a robot says once per neighbor cycle, byte by byte.
//!
//! ```text
//! offset  size  field
//!      0     1  kind (1 = localization)
//!      1     1  payload length in bytes
//!      2     2  incarnation of the sender, little endian
//!      4     4  index of the sender, little endian
//!      8     4  sequence number, little endian
//!     12     n  payload, the controller's own (the paper's: a light reading, 4 bytes, f32, little endian)
//!   12+n     2  CRC-16/IBM-3740 over all bytes before it, little endian
//! ```
//!
//! Range, bearing and orientation are not in the packet: the receiver's infrared ring measures them.

use arrayvec::ArrayVec;
use crc::{CRC_16_IBM_3740, Crc, Table};

use crate::{payload::PAYLOAD_BYTES_MAX, robot_id::RobotId};

/// Kind byte of a localization packet, and with it the version of this layout.
const LOCALIZATION: u8 = 1;
/// Bytes of a frame before the payload.
pub const HEADER_BYTES: usize = 12;
const CRC_BYTES: usize = 2;
/// Longest payload that lies in a [`Packet`] itself.
const INLINE_BYTES: usize = 4;
/// Longest frame, in bytes.
pub const FRAME_BYTES_MAX: usize = frame_bytes(PAYLOAD_BYTES_MAX);

/// Checksum by sixteen bytes at a time, which is what a packet of the paper's robots has before it. A static, as a
/// table that all agents share.
static CHECKSUM: Crc<u16, Table<16>> = Crc::<u16, Table<16>>::new(&CRC_16_IBM_3740);

/// The bytes of one frame in the air.
pub type Frame = ArrayVec<u8, FRAME_BYTES_MAX>;

/// Length of the frame around a payload, both in bytes.
pub const fn frame_bytes(payload: usize) -> usize {
    HEADER_BYTES + payload + CRC_BYTES
}

/// A packet on its way, small enough to be copied to all who hear it.
///
/// A payload of up to 4 bytes lies in it; a longer one in a buffer of whoever holds the packet: a percept
/// ([`Percept::payload`](crate::percept::Percept::payload)) or the arena.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Packet {
    index: u32,
    incarnation: u16,
    len: u8,
    sequence: u32,
    /// The payload, padded with zeros, or its place beside, little endian.
    word: [u8; INLINE_BYTES],
}
const _: () = assert!(size_of::<Packet>() == 16);

/// Where a packet's payload is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Body<'a> {
    /// In the packet.
    Inline(&'a [u8]),
    /// In the buffer of whoever holds the packet.
    Beside {
        /// The place that the buffer gave it.
        place: u32,
        /// Length in bytes.
        len: usize,
    },
}

/// A packet in full: what a frame says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PacketView<'a> {
    /// The robot that sent it.
    pub sender: RobotId,
    /// Counts the sender's packets since its boot; wraps.
    pub sequence: u32,
    /// Its payload; at most [`PAYLOAD_BYTES_MAX`] bytes.
    pub payload: &'a [u8],
}

/// Why a received frame is not an ISIS packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PacketError {
    /// Too short, too long, or not as long as its own length byte says.
    #[error("frame holds {actual} bytes, this packet needs {expected}")]
    Length {
        /// Bytes the layout asks for.
        expected: usize,
        /// Bytes that came.
        actual: usize,
    },
    /// Bits flipped on the way.
    #[error("checksum field is {received:#06x}, the bytes give {computed:#06x}")]
    Checksum {
        /// Checksum in the frame.
        received: u16,
        /// Checksum of its bytes.
        computed: u16,
    },
    /// A kind this version does not speak.
    #[error("packet kind is {0}, only {LOCALIZATION} (localization) is known")]
    Kind(u8),
}

impl Packet {
    /// A packet with a payload of 4 bytes, or of none if it is `None`.
    #[inline]
    pub const fn short(sender: RobotId, sequence: u32, payload: Option<[u8; INLINE_BYTES]>) -> Self {
        let (len, word) = match payload {
            Some(word) => (INLINE_BYTES as u8, word),
            None => (0, [0; INLINE_BYTES]),
        };
        Self { index: sender.index, incarnation: sender.incarnation, len, sequence, word }
    }

    /// The packet that `view` shows. If its payload is too long to lie in it, `keep` is given it and returns its place.
    #[inline]
    pub fn of(view: &PacketView<'_>, keep: impl FnOnce(&[u8]) -> u32) -> Self {
        let PacketView { sender, sequence, payload } = *view;
        // First the one that is most frequent, and copied in one piece.
        let word = <[u8; INLINE_BYTES]>::try_from(payload).unwrap_or_else(|_| {
            let mut word = [0; INLINE_BYTES];
            match word.get_mut(..payload.len()) {
                Some(word) => word.copy_from_slice(payload),
                None => word = keep(payload).to_le_bytes(),
            }
            word
        });
        Self { len: payload.len() as u8, word, ..Self::short(sender, sequence, None) }
    }

    /// The robot that sent it.
    #[inline]
    pub const fn sender(&self) -> RobotId {
        RobotId { index: self.index, incarnation: self.incarnation }
    }

    /// Counts the sender's packets since its boot; wraps.
    #[inline]
    pub const fn sequence(&self) -> u32 {
        self.sequence
    }

    /// Where its payload is.
    #[inline]
    pub fn body(&self) -> Body<'_> {
        match self.word.get(..usize::from(self.len)) {
            Some(payload) => Body::Inline(payload),
            None => Body::Beside { place: u32::from_le_bytes(self.word), len: self.len.into() },
        }
    }

    /// The packet in full, with the payload that [`body`](Self::body) points to.
    #[inline]
    pub fn view<'a>(&self, payload: &'a [u8]) -> PacketView<'a> {
        PacketView { sender: self.sender(), sequence: self.sequence, payload }
    }

    /// The same packet in the name of `sender`.
    #[must_use]
    pub fn from_sender(self, sender: RobotId) -> Self {
        Self { index: sender.index, incarnation: sender.incarnation, ..self }
    }
}

impl<'a> PacketView<'a> {
    /// The bytes of its frame before the payload.
    #[inline]
    pub fn header(&self) -> [u8; HEADER_BYTES] {
        let mut bytes = [0; HEADER_BYTES];
        bytes[0] = LOCALIZATION;
        bytes[1] = self.payload.len() as u8;
        bytes[2..4].copy_from_slice(&self.sender.incarnation.to_le_bytes());
        bytes[4..8].copy_from_slice(&self.sender.index.to_le_bytes());
        bytes[8..12].copy_from_slice(&self.sequence.to_le_bytes());
        bytes
    }

    /// The frame that carries this packet.
    pub fn encode(&self) -> Frame {
        let mut frame = Frame::new();
        self.encode_to(&mut frame);
        frame
    }

    /// Writes the frame that carries this packet over `frame`. Returned, one that is mostly empty would be moved whole.
    #[inline]
    pub fn encode_to(&self, frame: &mut Frame) {
        frame.clear();
        let mut add = |bytes: &[u8]| {
            frame.try_extend_from_slice(bytes).expect("a payload leaves room for the rest");
        };
        add(&self.header());
        add(self.payload);
        let checksum = checksum(frame).to_le_bytes();
        frame.extend(checksum);
    }

    /// Checks and reads a frame: length first, then checksum, then kind.
    #[inline]
    pub fn decode(frame: &'a [u8]) -> Result<Self, PacketError> {
        let length =
            |payload: usize| PacketError::Length { expected: frame_bytes(payload), actual: frame.len() };
        let Some((said, received)) = frame.split_last_chunk().filter(|(said, _)| said.len() >= HEADER_BYTES)
        else {
            return Err(length(0));
        };
        let (received, computed) = (u16::from_le_bytes(*received), checksum(said));
        if received != computed {
            return Err(PacketError::Checksum { received, computed });
        }
        if said[0] != LOCALIZATION {
            return Err(PacketError::Kind(said[0]));
        }
        let payload = &said[HEADER_BYTES..];
        if payload.len() != usize::from(said[1]) || payload.len() > PAYLOAD_BYTES_MAX {
            return Err(length(said[1].into()));
        }
        let word = |at: usize| u32::from_le_bytes([said[at], said[at + 1], said[at + 2], said[at + 3]]);
        let sender = RobotId { index: word(4), incarnation: u16::from_le_bytes([said[2], said[3]]) };
        Ok(Self { sender, sequence: word(8), payload })
    }

    /// Whether `frame` is the one that carries this packet, but for its checksum.
    #[inline]
    pub fn is_in(&self, frame: &[u8]) -> bool {
        let Some((header, rest)) = frame.split_first_chunk() else { return false };
        let Some((payload, _)) = rest.split_last_chunk::<CRC_BYTES>() else { return false };
        *header == self.header() && same(payload, self.payload)
    }
}

/// Whether two payloads are equal. Those of the paper's packets, whose length the compiler knows here, need no call.
#[inline]
fn same(a: &[u8], b: &[u8]) -> bool {
    match (<&[u8; INLINE_BYTES]>::try_from(a), <&[u8; INLINE_BYTES]>::try_from(b)) {
        (Ok(a), Ok(b)) => a == b,
        _ => a == b,
    }
}

/// Of the length that the paper's packets have, which the compiler knows here, it takes half as long.
#[inline]
fn checksum(bytes: &[u8]) -> u16 {
    match <&[u8; HEADER_BYTES + INLINE_BYTES]>::try_from(bytes) {
        Ok(bytes) => CHECKSUM.checksum(bytes),
        Err(_) => checksum_of_any(bytes),
    }
}

#[cold]
#[inline(never)]
fn checksum_of_any(bytes: &[u8]) -> u16 {
    CHECKSUM.checksum(bytes)
}

#[cfg(test)]
mod tests {
    use std::string::ToString;

    use proptest::prelude::*;

    use super::*;

    const LIGHT: [u8; 4] = 1.5_f32.to_le_bytes();
    const PACKET: PacketView<'_> = PacketView {
        sender: RobotId { index: 0x0102_0304, incarnation: 0x0506 },
        sequence: 7,
        payload: &LIGHT,
    };

    #[test]
    fn the_layout_is_what_the_header_says() {
        let bytes = PACKET.encode();
        assert_eq!(bytes[..12], [1, 4, 6, 5, 4, 3, 2, 1, 7, 0, 0, 0]);
        assert_eq!(bytes[12..16], LIGHT);
        assert_eq!(bytes.len(), 18);
    }

    #[test]
    fn the_checksum_is_the_published_one() {
        assert_eq!(CHECKSUM.checksum(b"123456789"), 0x29b1, "check value of CRC-16/IBM-3740");
    }

    #[test]
    fn a_short_frame_names_both_lengths() {
        let error = PacketView::decode(&PACKET.encode()[..5]).unwrap_err();
        assert_eq!(error.to_string(), "frame holds 5 bytes, this packet needs 14");
    }

    #[test]
    fn a_frame_that_lies_about_its_payload_is_refused() {
        let mut bytes = PACKET.encode();
        bytes[1] = 20;
        let checksum = CHECKSUM.checksum(&bytes[..16]).to_le_bytes();
        bytes[16..].copy_from_slice(&checksum);
        assert_eq!(PacketView::decode(&bytes), Err(PacketError::Length { expected: 34, actual: 18 }));
    }

    #[test]
    fn only_a_payload_longer_than_four_bytes_lies_beside_its_packet() {
        let bytes: std::vec::Vec<u8> = (1..=128).collect();
        for len in [0, 1, 4, 5, 128] {
            let view = PacketView { payload: &bytes[..len], ..PACKET };
            let mut kept = None;
            let packet = Packet::of(&view, |payload| {
                kept = Some(payload.len());
                77
            });
            match packet.body() {
                Body::Inline(payload) => assert_eq!((payload, kept), (view.payload, None)),
                Body::Beside { place, len } => assert_eq!((place, kept), (77, Some(len))),
            }
            assert_eq!(packet.view(view.payload), view);
            assert_eq!(kept.is_some(), len > 4);
        }
    }

    proptest! {
        #[test]
        fn every_packet_survives_the_air(
            index: u32, incarnation: u16, sequence: u32,
            payload in proptest::collection::vec(any::<u8>(), 0..=PAYLOAD_BYTES_MAX),
        ) {
            let packet = PacketView { sender: RobotId { index, incarnation }, sequence, payload: &payload };
            let frame = packet.encode();
            prop_assert_eq!(PacketView::decode(&frame), Ok(packet));
            prop_assert!(packet.is_in(&frame));
            let next = PacketView { sequence: sequence.wrapping_add(1), ..packet };
            prop_assert!(!next.is_in(&frame));
        }

        #[test]
        fn up_to_three_flipped_bits_never_pass(flips in proptest::collection::btree_set(0_usize..18 * 8, 1..=3)) {
            let mut bytes = PACKET.encode();
            for bit in flips {
                bytes[bit / 8] ^= 1 << (bit % 8);
            }
            prop_assert!(PacketView::decode(&bytes).is_err());
        }

        #[test]
        fn arbitrary_bytes_never_panic(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
            let _ = PacketView::decode(&bytes);
        }
    }
}

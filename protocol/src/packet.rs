//! The infrared packet: what a robot says once per neighbor cycle, byte by byte.
//!
//! ```text
//! offset  size  field
//!      0     1  kind (1 = localization)
//!      1     1  payload length in bytes
//!      2     2  incarnation of the sender, little endian
//!      4     4  index of the sender, little endian
//!      8     4  sequence number, little endian
//!     12     n  payload (a light reading: 4 bytes, f32, little endian)
//!   12+n     2  CRC-16/IBM-3740 over all bytes before it, little endian
//! ```
//!
//! Range, bearing and orientation are not in the packet: the receiver's infrared ring measures them.

use arrayvec::ArrayVec;
use crc::{CRC_16_IBM_3740, Crc, Table};

use crate::robot_id::RobotId;

/// Longest frame the infrared carries, in bytes. With its length, a frame fills three words of shared memory, and
/// how many lines of cache a percept takes is most of what it costs.
pub const PACKET_BYTES_MAX: usize = 23;

/// Kind byte of a localization packet, and with it the version of this layout.
const LOCALIZATION: u8 = 1;
const HEADER_BYTES: usize = 12;
const LIGHT_BYTES: usize = 4;
const CRC_BYTES: usize = 2;
/// Length of the frame of a localization packet, in bytes.
pub const LOCALIZATION_BYTES: usize = HEADER_BYTES + LIGHT_BYTES + CRC_BYTES;
const _: () = assert!(LOCALIZATION_BYTES <= PACKET_BYTES_MAX);

/// By sixteen bytes at a time, which is what a localization packet has before its checksum. A static, as a table
/// that all agents share.
static CHECKSUM: Crc<u16, Table<16>> = Crc::<u16, Table<16>>::new(&CRC_16_IBM_3740);

/// The bytes of one frame in the air.
pub type Frame = ArrayVec<u8, PACKET_BYTES_MAX>;

/// One ISIS localization message, checked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Packet {
    /// The robot that sent it.
    pub sender: RobotId,
    /// Counts the sender's packets since its boot; wraps.
    pub sequence: u32,
    /// The sender's own light reading in counts, finite.
    pub light: f32,
}

/// Makes a robot's packets: each with its name and the next number, counted from 0 at its boot.
#[derive(Clone, Debug)]
pub struct Transmitter {
    sender: RobotId,
    sequence: u32,
}

impl Transmitter {
    /// The transmitter of a robot that has just booted.
    pub fn new(sender: RobotId) -> Self {
        Self { sender, sequence: 0 }
    }

    /// Returns the next packet, with a light reading in counts. A reading past f32 is sent as the largest one that a
    /// packet can carry.
    pub fn packet(&mut self, light: f64) -> Packet {
        let sequence = self.sequence;
        self.sequence = self.sequence.wrapping_add(1);
        let light = light.clamp(f64::from(f32::MIN), f64::from(f32::MAX)) as f32;
        Packet { sender: self.sender, sequence, light }
    }
}

/// Why a received frame is not an ISIS packet.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
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
    /// The light reading is NaN or infinite.
    #[error("light reading is {0}, not a finite number")]
    Light(f32),
}

impl Packet {
    /// The frame that carries this packet.
    #[inline]
    pub fn encode(&self) -> Frame {
        let mut bytes = [0; LOCALIZATION_BYTES];
        bytes[0] = LOCALIZATION;
        bytes[1] = LIGHT_BYTES as u8;
        bytes[2..4].copy_from_slice(&self.sender.incarnation.to_le_bytes());
        bytes[4..8].copy_from_slice(&self.sender.index.to_le_bytes());
        bytes[8..12].copy_from_slice(&self.sequence.to_le_bytes());
        bytes[12..16].copy_from_slice(&self.light.to_le_bytes());
        let checksum = CHECKSUM.checksum(&bytes[..LOCALIZATION_BYTES - CRC_BYTES]);
        bytes[LOCALIZATION_BYTES - CRC_BYTES..].copy_from_slice(&checksum.to_le_bytes());
        bytes.into_iter().collect()
    }

    /// Checks and reads a frame: length first, then checksum, kind and payload.
    #[inline]
    pub fn decode(frame: &[u8]) -> Result<Self, PacketError> {
        let bytes: &[u8; LOCALIZATION_BYTES] = frame
            .try_into()
            .map_err(|_| PacketError::Length { expected: LOCALIZATION_BYTES, actual: frame.len() })?;
        let received = u16::from_le_bytes([bytes[16], bytes[17]]);
        let computed = CHECKSUM.checksum(&bytes[..LOCALIZATION_BYTES - CRC_BYTES]);
        if received != computed {
            return Err(PacketError::Checksum { received, computed });
        }
        if bytes[0] != LOCALIZATION {
            return Err(PacketError::Kind(bytes[0]));
        }
        if usize::from(bytes[1]) != LIGHT_BYTES {
            let expected = HEADER_BYTES + usize::from(bytes[1]) + CRC_BYTES;
            return Err(PacketError::Length { expected, actual: LOCALIZATION_BYTES });
        }
        let word = |at: usize| [bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]];
        let light = f32::from_le_bytes(word(12));
        if !light.is_finite() {
            return Err(PacketError::Light(light));
        }
        Ok(Self {
            sender: RobotId {
                index: u32::from_le_bytes(word(4)),
                incarnation: u16::from_le_bytes([bytes[2], bytes[3]]),
            },
            sequence: u32::from_le_bytes(word(8)),
            light,
        })
    }
}

#[cfg(test)]
mod tests {
    use std::string::ToString;

    use proptest::prelude::*;

    use super::*;

    const PACKET: Packet =
        Packet { sender: RobotId { index: 0x0102_0304, incarnation: 0x0506 }, sequence: 7, light: 1.5 };

    #[test]
    fn the_layout_is_what_the_header_says() {
        let bytes = PACKET.encode();
        assert_eq!(bytes[..12], [1, 4, 6, 5, 4, 3, 2, 1, 7, 0, 0, 0]);
        assert_eq!(bytes[12..16], 1.5_f32.to_le_bytes());
        assert_eq!(bytes.len(), 18);
    }

    #[test]
    fn the_checksum_is_the_published_one() {
        assert_eq!(CHECKSUM.checksum(b"123456789"), 0x29b1, "check value of CRC-16/IBM-3740");
    }

    #[test]
    fn a_short_frame_names_both_lengths() {
        let error = Packet::decode(&PACKET.encode()[..5]).unwrap_err();
        assert_eq!(error.to_string(), "frame holds 5 bytes, this packet needs 18");
    }

    #[test]
    fn a_frame_that_lies_about_its_payload_is_refused() {
        let mut bytes = PACKET.encode();
        bytes[1] = 20;
        let checksum = CHECKSUM.checksum(&bytes[..16]).to_le_bytes();
        bytes[16..].copy_from_slice(&checksum);
        assert_eq!(Packet::decode(&bytes), Err(PacketError::Length { expected: 34, actual: 18 }));
    }

    #[test]
    fn a_nan_reading_is_refused_even_with_a_good_checksum() {
        let nan = Packet { light: f32::NAN, ..PACKET };
        assert!(matches!(Packet::decode(&nan.encode()), Err(PacketError::Light(_))));
    }

    proptest! {
        #[test]
        fn every_packet_survives_the_air(index: u32, incarnation: u16, sequence: u32, light in -1e30_f32..1e30) {
            let packet = Packet { sender: RobotId { index, incarnation }, sequence, light };
            prop_assert_eq!(Packet::decode(&packet.encode()), Ok(packet));
        }

        #[test]
        fn up_to_three_flipped_bits_never_pass(flips in proptest::collection::btree_set(0_usize..18 * 8, 1..=3)) {
            let mut bytes = PACKET.encode();
            for bit in flips {
                bytes[bit / 8] ^= 1 << (bit % 8);
            }
            prop_assert!(Packet::decode(&bytes).is_err());
        }

        #[test]
        fn arbitrary_bytes_never_panic(bytes in proptest::collection::vec(any::<u8>(), 0..64)) {
            let _ = Packet::decode(&bytes);
        }
    }
}

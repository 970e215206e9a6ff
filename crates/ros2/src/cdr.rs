//! Messages as bytes: CDR, little-endian, as DDS sends them.
//!
//! Source: OMG DDS-RTPS 2.5 (the header) and OMG CORBA 3.4, CDR Transfer Syntax (the rest). A number is aligned to its size, counted
//! from behind the header; a string has its length, which counts its zero at the end, and a sequence its number of elements
//! in front.

use byteorder::LittleEndian;
use serde::Serialize;

/// Says that plain CDR follows, little-endian; the last two bytes are options, of which there are none.
const HEADER: [u8; 4] = [0x00, 0x01, 0x00, 0x00];

/// Writes `message` to `bytes`, in place of what they hold.
///
/// # Errors
/// If it holds a kind of value that CDR has not.
pub(crate) fn encode(message: &impl Serialize, bytes: &mut Vec<u8>) -> Result<(), cdr_encoding::Error> {
    bytes.clear();
    bytes.extend(HEADER);
    // It counts from where it begins, and so from behind the header.
    cdr_encoding::to_writer::<_, LittleEndian, _>(bytes, message)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::messages::{Clock, Color, Float64, Header, Marker, Point, Pose, PoseArray, Time};

    /// The bytes of `message` behind its header.
    fn body(message: &impl Serialize) -> Vec<u8> {
        let mut bytes = vec![0xaa; 3];
        encode(message, &mut bytes).unwrap();
        assert_eq!(bytes[..4], [0, 1, 0, 0]);
        bytes[4..].to_vec()
    }

    #[test]
    fn numbers_are_little_endian_and_aligned_from_behind_the_header() {
        assert_eq!(
            body(&Clock { clock: Time { sec: -2, nanosec: 0x0102_0304 } }),
            [0xfe, 0xff, 0xff, 0xff, 4, 3, 2, 1]
        );
        // Not moved by the four bytes of the header.
        assert_eq!(body(&Float64 { data: 1.0 }), [0, 0, 0, 0, 0, 0, 0xf0, 0x3f]);
        #[derive(Serialize)]
        struct Mixed(u8, u16, u8, u32, bool, f64, f32);
        assert_eq!(
            body(&Mixed(1, 2, 3, 4, true, 0.5, -1.0)),
            [[1, 0, 2, 0, 3, 0, 0, 0], [4, 0, 0, 0, 1, 0, 0, 0], [0, 0, 0, 0, 0, 0, 0xe0, 0x3f],]
                .concat()
                .into_iter()
                .chain([0, 0, 0x80, 0xbf])
                .collect::<Vec<_>>()
        );
    }

    #[test]
    fn strings_end_with_a_zero_that_counts_and_sequences_begin_with_their_length() {
        let header = Header { stamp: Time { sec: 1, nanosec: 2 }, frame_id: "odd".into() };
        let time = [1, 0, 0, 0, 2, 0, 0, 0];
        let empty = PoseArray { header: header.clone(), poses: vec![] };
        assert_eq!(
            body(&empty),
            [&time[..], &[4, 0, 0, 0, b'o', b'd', b'd', 0], &[0; 4]].concat(),
            "an empty sequence of numbers of eight bytes is not padded"
        );
        // "evened" and its zero end at 19; the length stands at 20, and the first number of eight bytes at 24.
        let header = Header { frame_id: "evened".into(), ..header };
        let pose = Pose { position: Point { x: 1.0, ..Point::default() }, ..Pose::default() };
        let one = body(&PoseArray { header, poses: vec![pose] });
        let expected = [
            &time[..],
            &[7, 0, 0, 0, b'e', b'v', b'e', b'n', b'e', b'd', 0, 0],
            &[1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xf0, 0x3f],
        ];
        assert_eq!(one[..32], expected.concat());
        assert_eq!(one.len(), 24 + 7 * 8);
        // The empty string has a length of one. Here numbers of eight bytes follow at 16 without a gap.
        let nameless = PoseArray { header: Header::default(), poses: vec![Pose::default()] };
        assert_eq!(body(&nameless)[8..24], [1, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0]);
    }

    #[test]
    fn a_marker_is_aligned_to_its_last_byte() {
        let marker = Marker {
            ns: "n".into(),
            id: 7,
            color: Color { a: 1.0, ..Color::default() },
            points: vec![Point { z: 1.0, ..Point::default() }],
            ..Marker::default()
        };
        let bytes = body(&marker);
        // Stamp to 8, empty frame to 13, padding to 16, "n" to 22, padding to 24, three numbers to 36.
        assert_eq!(bytes[12..28], [0, 0, 0, 0, 2, 0, 0, 0, b'n', 0, 0, 0, 7, 0, 0, 0]);
        // Padding to 40, pose to 96, scale to 120, color to 136, lifetime to 144, a flag to 145, padding to 148, the length of
        // the points to 152, one point to 176.
        assert_eq!(bytes[132..136], 1.0f32.to_le_bytes());
        assert_eq!(bytes[144..152], [0, 0, 0, 0, 1, 0, 0, 0]);
        assert_eq!(bytes[168..176], 1.0f64.to_le_bytes());
        // No colors to 180; texture: its name to 185, stamp from 188 to 196, frame to 201, format from 204 to 209, no data from
        // 212 to 216; no coordinates to 220; text to 225, mesh from 228 to 233, its file: name from 236 to 241, no data from
        // 244 to 248; a flag.
        assert_eq!(bytes.len(), 249);
    }
}

//! The payload of the paper's robots: the sender's own light reading, in counts, as 4 bytes of f32, little endian.

use protocol::{
    packet::{Body, Packet},
    payload::Payload,
};

/// Length of the payload, bytes.
pub const READING_BYTES: usize = 4;

/// The payload that carries a light reading. One past f32 is sent as the largest that a packet can carry.
#[inline]
pub(crate) fn payload(light: f64) -> Payload {
    let light = light.clamp(f64::from(f32::MIN), f64::from(f32::MAX)) as f32;
    light.to_le_bytes().into()
}

/// The reading that a packet carries. Any other payload has none: its sender is a neighbor with a place all the same.
#[inline]
pub(crate) fn shared_in(packet: &Packet) -> Option<f64> {
    let Body::Inline(payload) = packet.body() else { return None };
    let light = f32::from_le_bytes(payload.try_into().ok()?);
    light.is_finite().then(|| light.into())
}

#[cfg(test)]
mod tests {
    use protocol::{packet::PacketView, robot_id::RobotId};

    use super::*;

    fn shared(payload: &[u8]) -> Option<f64> {
        shared_in(&Packet::of(&PacketView { sender: RobotId::first(0), sequence: 0, payload }, |_| 0))
    }

    #[test]
    fn a_reading_survives_its_packet_and_one_past_f32_is_the_largest_there_is() {
        assert_eq!(shared(&payload(2.5)), Some(2.5));
        assert_eq!(shared(&payload(-1e300)), Some(f32::MIN.into()));
    }

    #[test]
    fn any_other_payload_is_no_reading() {
        for light in [f32::NAN, f32::INFINITY] {
            assert_eq!(shared(&light.to_le_bytes()), None);
        }
        for len in [0, 3, 5, 128] {
            assert_eq!(shared(&[0; 128][..len]), None);
        }
    }
}

//! `liar`: packets carry a false reading or other false bytes, or another robot's name.

use protocol::{packet::Packet, payload::Payload, robot_id::RobotId};

use super::rule::Rule;
use crate::payloads::Payloads;
use scenario::{PayloadHex, Scenario, fault};

#[derive(Debug)]
pub(super) struct Liar {
    /// A reading as packets carry it.
    light: Option<[u8; 4]>,
    bytes: Option<PayloadHex>,
    offset: usize,
    identity: Option<u32>,
}

impl Liar {
    pub(super) fn new(spec: &fault::Liar, _: &Scenario) -> Self {
        let as_sent = |light: f64| light.clamp(f64::from(f32::MIN), f64::from(f32::MAX)) as f32;
        Self {
            light: spec.light_counts.map(|light| as_sent(light.get()).to_le_bytes()),
            bytes: spec.payload_hex.clone(),
            offset: spec.payload_offset.get().into(),
            identity: spec.identity,
        }
    }

    /// Returns the payload of a packet instead of its own; `None` if its payload is no reading and ends too early for other bytes.
    fn payload(&self, said: &[u8]) -> Option<Payload> {
        let mut payload = Payload::try_from(said).expect("it is the payload of a packet");
        let length = payload.len();
        let light = self.light.as_ref().filter(|light| light.len() == length).map(|light| (0, &light[..]));
        let bytes = self.bytes.as_ref().map(|hex| (self.offset, hex.bytes()));
        let bytes = bytes.filter(|(at, bytes)| at + bytes.len() <= length);
        light.or(bytes)?;
        for (at, bytes) in light.into_iter().chain(bytes) {
            payload[at..at + bytes.len()].copy_from_slice(bytes);
        }
        Some(payload)
    }
}

impl Rule for Liar {
    fn speak(&mut self, packet: &mut Packet, payloads: &mut Payloads) -> bool {
        let payload = self.payload(payloads.of(packet));
        if let Some(payload) = &payload {
            *packet = payloads.packet(&packet.view(payload));
        }
        if let Some(index) = self.identity {
            *packet = packet.from_sender(RobotId { index, ..packet.sender() });
        }
        payload.is_some() || self.identity.is_some()
    }
}

//! `liar`: packets carry a false reading, or another robot's name.

use protocol::{packet::Packet, payload::Payload, robot_id::RobotId};

use super::rule::Rule;
use crate::payloads::Payloads;
use scenario::FaultSpec;

#[derive(Debug)]
pub(super) struct Liar {
    /// A reading as packets carry it.
    light: Option<[u8; 4]>,
    identity: Option<u32>,
}

impl Liar {
    pub(super) fn new(spec: &FaultSpec) -> Self {
        let as_sent = |light: f64| light.clamp(f64::from(f32::MIN), f64::from(f32::MAX)) as f32;
        Self {
            light: spec.light_counts.map(|light| as_sent(light.get()).to_le_bytes()),
            identity: spec.identity,
        }
    }
}

impl Rule for Liar {
    /// A packet whose payload is no reading, or ends too early, says what it did.
    fn speak(&mut self, packet: &mut Packet, payloads: &mut Payloads) -> bool {
        let mut payload = Payload::try_from(payloads.of(packet)).expect("it is the payload of a packet");
        let is_reading = |light: &[u8; 4]| light.len() == payload.len();
        let replaced = match self.light.filter(is_reading) {
            Some(light) => {
                payload.copy_from_slice(&light);
                true
            }
            None => false,
        };
        if replaced {
            *packet = payloads.packet(&packet.view(&payload));
        }
        if let Some(index) = self.identity {
            *packet = packet.from_sender(RobotId { index, ..packet.sender() });
        }
        replaced || self.identity.is_some()
    }
}

//! `liar`: packets carry a false reading, or another robot's name.

use protocol::{packet::Packet, robot_id::RobotId};

use super::rule::Rule;
use scenario::{Scenario, fault};

#[derive(Debug)]
pub(super) struct Liar {
    light: Option<f32>,
    identity: Option<u32>,
}

impl Liar {
    pub(super) fn new(spec: &fault::Liar, _: &Scenario) -> Self {
        let as_sent = |light: f64| light.clamp(f64::from(f32::MIN), f64::from(f32::MAX)) as f32;
        Self { light: spec.light_counts.map(|light| as_sent(light.get())), identity: spec.identity }
    }
}

impl Rule for Liar {
    fn speak(&mut self, packet: &mut Packet) -> bool {
        if let Some(light) = self.light {
            packet.light = light;
        }
        if let Some(index) = self.identity {
            packet.sender = RobotId { index, ..packet.sender };
        }
        true
    }
}

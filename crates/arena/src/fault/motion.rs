//! `motion`: bodies are stuck, or drift off their course.

use protocol::frame::BodyVector;

use super::rule::Rule;
use scenario::FaultSpec;

#[derive(Debug)]
pub(super) struct Motion {
    stuck: bool,
    drift: BodyVector,
}

impl Motion {
    pub(super) fn new(spec: &FaultSpec) -> Self {
        let [ahead, left] = spec.drift_m_per_s.map_or([0.0, 0.0], |drift| drift.get());
        Self { stuck: spec.stuck == Some(true), drift: BodyVector::new(ahead, left) }
    }
}

impl Rule for Motion {
    fn drive(&mut self, velocity: &mut Option<BodyVector>) -> bool {
        *velocity = velocity.filter(|_| !self.stuck).map(|velocity| BodyVector(velocity.0 + self.drift.0));
        true
    }
}

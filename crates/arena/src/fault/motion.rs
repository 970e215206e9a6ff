//! `motion`: bodies are stuck, or drift off their course.

use protocol::frame::BodyVector;

use super::rule::Rule;
use scenario::{Scenario, fault};

#[derive(Debug)]
pub(super) struct Motion {
    stuck: bool,
    drift: Option<BodyVector>,
}

impl Motion {
    pub(super) fn new(spec: &fault::Motion, _: &Scenario) -> Self {
        let drift = spec.drift_m_per_s.map(|drift| drift.get());
        Self { stuck: spec.stuck, drift: drift.map(|[ahead, left]| BodyVector::new(ahead, left)) }
    }
}

impl Rule for Motion {
    fn drive(&mut self, velocity: &mut Option<BodyVector>) -> bool {
        *velocity = velocity.filter(|_| !self.stuck);
        if let (Some(velocity), Some(drift)) = (velocity, self.drift) {
            velocity.0 += drift.0;
        }
        true
    }
}

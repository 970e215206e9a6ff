//! `partition`: groups of robots cannot hear each other, or those in a disc and those out of it.

use super::{
    rng::FaultRng,
    rule::{Flight, Rule, Verdict},
    target::Scene,
};
use crate::frame::ArenaPoint;
use crate::payloads::Payloads;
use scenario::{Disc, FaultSpec, RobotSet};

#[derive(Debug)]
pub(super) struct Partition {
    groups: Vec<RobotSet>,
    region: Option<Disc>,
    one_way: bool,
    /// Robots that were inside the disc when it began.
    inside: Vec<bool>,
}

impl Partition {
    pub(super) fn new(spec: &FaultSpec) -> Self {
        Self {
            groups: spec.groups.clone().unwrap_or_default(),
            region: spec.region,
            one_way: spec.one_way == Some(true),
            inside: Vec::new(),
        }
    }

    /// Which part a robot belongs to, if to any. The disc comes first, what lies around it second.
    fn part(&self, robot: u32) -> Option<usize> {
        match self.region {
            Some(_) => Some(usize::from(!self.inside[robot as usize])),
            None => self.groups.iter().position(|group| group.contains(robot)),
        }
    }
}

impl Rule for Partition {
    fn look(&mut self, scene: &Scene<'_>) {
        if let Some(Disc { center_m, radius_m }) = self.region {
            let center = ArenaPoint::from(center_m.get());
            let inside = |pose: &crate::frame::Pose| (pose.position - center).norm() <= radius_m.get();
            self.inside = scene.poses.iter().map(inside).collect();
        }
    }

    fn chooses_itself(&self) -> bool {
        true
    }

    fn judge(&mut self, flight: &Flight, _: FaultRng, _: &mut Payloads) -> Verdict {
        let (sender, receiver) = (flight.reception.sender, flight.reception.receiver);
        let apart = match (self.part(sender), self.part(receiver)) {
            (Some(from), Some(to)) if self.one_way => from < to,
            (Some(from), Some(to)) => from != to,
            _ => false,
        };
        if apart { Verdict::Drop("packets dropped") } else { Verdict::Pass }
    }
}

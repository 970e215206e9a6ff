//! `partition`: groups of robots cannot hear each other, or those in a disc and those out of it.

use super::{
    rng::FaultRng,
    rule::{Flight, Rule, Verdict},
    target::{Scene, covers},
};
use crate::payloads::Payloads;
use scenario::{
    Scenario,
    fault::{self, Parts},
};

#[derive(Debug)]
pub(super) struct Partition {
    spec: fault::Partition,
    /// Robots that were inside the disc when it began.
    inside: Vec<bool>,
}

impl Partition {
    pub(super) fn new(spec: &fault::Partition, _: &Scenario) -> Self {
        Self { spec: spec.clone(), inside: Vec::new() }
    }

    /// Which part a robot belongs to, if to any. The disc comes first, what lies around it second.
    fn part(&self, robot: u32) -> Option<usize> {
        match &self.spec.parts {
            Parts::Disc(_) => Some(usize::from(!self.inside[robot as usize])),
            Parts::Groups(groups) => groups.iter().position(|group| group.contains(robot)),
        }
    }
}

impl Rule for Partition {
    fn look(&mut self, scene: &Scene<'_>) {
        if let Parts::Disc(disc) = &self.spec.parts {
            self.inside = scene.poses.iter().map(|pose| covers(disc, &pose.position)).collect();
        }
    }

    fn chooses_itself(&self) -> bool {
        true
    }

    fn judge(&mut self, flight: &Flight, _: FaultRng, _: &mut Payloads) -> Verdict {
        let (sender, receiver) = (flight.reception.sender, flight.reception.receiver);
        let apart = match (self.part(sender), self.part(receiver)) {
            (Some(from), Some(to)) if self.spec.one_way => from < to,
            (Some(from), Some(to)) => from != to,
            _ => false,
        };
        if apart { Verdict::Drop("packets dropped") } else { Verdict::Pass }
    }
}

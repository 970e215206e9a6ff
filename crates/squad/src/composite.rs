//! Squads that make up one.

use std::time::Instant;

use profile::CycleTimes;
use protocol::{
    notes::Notes,
    percept::{Percept, Tick},
    property::Property,
    robot_id::RobotId,
};
use scenario::ProcessFault;

use crate::{
    squad::{Answers, Incident, Squad, SquadError, WaitingSink},
    status::RobotStatus,
    stop::StopFlag,
};

/// Several squads, each with robots of its own, that are one to the loop of a run. All are sent their percepts before
/// any is asked for answers, so that they work at the same time.
pub struct Composite<'a> {
    parts: Vec<Box<dyn Squad + 'a>>,
}

impl<'a> Composite<'a> {
    /// The robots of all `parts`; no robot is in two of them.
    pub fn new(parts: Vec<Box<dyn Squad + 'a>>) -> Self {
        Self { parts }
    }

    fn each(
        &mut self,
        act: impl FnMut(&mut Box<dyn Squad + 'a>) -> Result<(), SquadError>,
    ) -> Result<(), SquadError> {
        self.parts.iter_mut().try_for_each(act)
    }
}

impl Squad for Composite<'_> {
    fn join_all(
        &mut self,
        answers: &mut Answers,
        stop: &StopFlag,
        waiting: &mut WaitingSink<'_>,
    ) -> Result<(), SquadError> {
        self.each(|part| part.join_all(answers, stop, waiting))
    }

    fn apply_process_faults(
        &mut self,
        tick: Tick,
        process_faults: &[ProcessFault],
        answers: &mut Answers,
        waiting: &mut WaitingSink<'_>,
    ) -> Result<(), SquadError> {
        self.each(|part| part.apply_process_faults(tick, process_faults, answers, waiting))
    }

    fn left_out(&self) -> Vec<u32> {
        let mut left_out: Vec<u32> = self.parts.iter().flat_map(|part| part.left_out()).collect();
        left_out.sort_unstable();
        left_out
    }

    fn send(&mut self, percepts: &[Percept]) -> Result<(), SquadError> {
        self.each(|part| part.send(percepts))
    }

    fn collect(&mut self, answers: &mut Answers, waiting: &mut WaitingSink<'_>) -> Result<(), SquadError> {
        self.each(|part| part.collect(answers, waiting))
    }

    /// The first part waits; the others take in what has come when it is time.
    fn poll_until(&mut self, due: Instant, waiting: &mut WaitingSink<'_>) -> Result<(), SquadError> {
        self.each(|part| part.poll_until(due, waiting))
    }

    fn now_ns(&self) -> Option<u64> {
        self.parts.iter().find_map(|part| part.now_ns())
    }

    fn take_cycles(&mut self, cycles: &mut Vec<CycleTimes>) {
        self.parts.iter_mut().for_each(|part| part.take_cycles(cycles));
    }

    fn take_incidents(&mut self, incidents: &mut Vec<Incident>) {
        self.parts.iter_mut().for_each(|part| part.take_incidents(incidents));
    }

    fn notes(&self, robot: u32) -> Option<&Notes> {
        self.parts.iter().find_map(|part| part.notes(robot))
    }

    fn take_properties(&mut self) -> Vec<(RobotId, Vec<Property>)> {
        let mut taken: Vec<_> = self.parts.iter_mut().flat_map(|part| part.take_properties()).collect();
        taken.sort_by_key(|(id, _)| *id);
        taken
    }

    fn robot_statuses(&self) -> Vec<RobotStatus> {
        let mut robots: Vec<RobotStatus> = self.parts.iter().flat_map(|part| part.robot_statuses()).collect();
        robots.sort_unstable_by_key(|robot| robot.id.index);
        robots
    }

    fn dismiss(&mut self) {
        self.parts.iter_mut().for_each(|part| part.dismiss());
    }
}

//! A squad that is traced: does what the squad within does, and tells when.

use std::{sync::Arc, time::Instant};

use arena::fault::ProcessFault;
use protocol::{
    notes::Notes,
    percept::{Percept, Tick},
};

use super::Tracer;
use crate::{
    live::{Live, SquadStatus},
    profile::Profile,
    squad::{Answers, Incident, RobotStatus, Squad, SquadError},
    stop::StopFlag,
};

/// A squad and who is told of it.
pub struct Traced<'a> {
    squad: Box<dyn Squad + 'a>,
    tracer: Tracer,
}

impl<'a> Traced<'a> {
    /// Has `tracer` told what `squad` does.
    pub fn new(squad: Box<dyn Squad + 'a>, tracer: Tracer) -> Self {
        Self { squad, tracer }
    }
}

impl Squad for Traced<'_> {
    fn join_all(&mut self, stop: &StopFlag) -> Result<Answers, SquadError> {
        self.squad.join_all(stop)
    }

    fn apply_process_faults(
        &mut self,
        tick: Tick,
        process_faults: &[ProcessFault],
        answers: &mut Answers,
    ) -> Result<(), SquadError> {
        self.tracer.with(|recording| recording.tick_begins(tick, process_faults));
        let struck = self.squad.apply_process_faults(tick, process_faults, answers);
        self.tracer.with(|recording| recording.incidents(self.squad.incidents()));
        struck
    }

    fn left_out(&self) -> Vec<u32> {
        self.squad.left_out()
    }

    fn exchange(&mut self, percepts: &[Percept], answers: &mut Answers) -> Result<(), SquadError> {
        self.tracer.with(|recording| recording.exchange_begins());
        let exchanged = self.squad.exchange(percepts, answers);
        self.tracer.with(|recording| {
            recording.exchange_ends();
            recording.incidents(self.squad.incidents());
        });
        exchanged
    }

    fn poll_until(&mut self, due: Instant) -> Result<(), SquadError> {
        self.squad.poll_until(due)
    }

    fn profile(&mut self) -> Option<Profile> {
        self.squad.profile()
    }

    fn live(&self) -> Option<Arc<Live>> {
        self.squad.live()
    }

    fn status_of_robots(&mut self, watched: bool) -> SquadStatus {
        self.squad.status_of_robots(watched)
    }

    fn notes(&self, index: usize) -> &Notes {
        self.squad.notes(index)
    }

    fn dismiss(&mut self) {
        self.squad.dismiss();
    }

    fn robot_statuses(&self) -> Vec<RobotStatus> {
        self.squad.robot_statuses()
    }

    fn incidents(&self) -> &[Incident] {
        self.squad.incidents()
    }
}

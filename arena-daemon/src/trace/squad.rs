//! A squad that is traced: does what the squad within does, and tells when.

use std::{sync::Arc, time::Instant};

use arena::fault::Strike;
use protocol::percept::{Percept, Tick};

use super::Tracer;
use crate::{
    live::{Live, Survey},
    profile::Profile,
    squad::{Answers, Incident, Squad, SquadError, Standing},
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
    fn muster(&mut self, stop: &StopFlag) -> Result<Answers, SquadError> {
        self.squad.muster(stop)
    }

    fn strike(&mut self, tick: Tick, strikes: &[Strike], answers: &mut Answers) -> Result<(), SquadError> {
        self.tracer.with(|recording| recording.tick_begins(tick, strikes));
        let struck = self.squad.strike(tick, strikes, answers);
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

    fn attend(&mut self, due: Instant) -> Result<(), SquadError> {
        self.squad.attend(due)
    }

    fn profile(&mut self) -> Option<Profile> {
        self.squad.profile()
    }

    fn live(&self) -> Option<Arc<Live>> {
        self.squad.live()
    }

    fn survey(&mut self, watched: bool) -> Survey {
        self.squad.survey(watched)
    }

    fn dismiss(&mut self) {
        self.squad.dismiss();
    }

    fn standings(&self) -> Vec<Standing> {
        self.squad.standings()
    }

    fn incidents(&self) -> &[Incident] {
        self.squad.incidents()
    }
}

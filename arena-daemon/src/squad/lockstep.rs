//! Processes in lock-step: the arena waits for every live agent, every tick.

use std::{mem, sync::Arc, thread, time::Duration};

use arena::fault::{ProcessAction, ProcessFault};
use protocol::{
    notes::Notes,
    percept::{Percept, Tick},
    setup::Mode,
};
use scenario::Scenario;

use super::{
    Answers, Incident, RobotStatus, Squad, SquadError,
    roster::{Heard, HostConfig, Roster},
};
use crate::{
    live::{Awaited, Live, SquadStatus},
    profile::Profile,
    standstill::Moment,
    stop::StopFlag,
};

/// How long the arena sleeps before it asks whether who is missing is still alive.
const ALIVE_POLL: Duration = Duration::from_millis(20);
/// How long it waits for an answer that the doorbell has announced too early.
const EARLY_RING: Duration = Duration::from_millis(1);

/// Agents that answer tick by tick.
#[derive(Debug)]
pub struct Lockstep {
    members: Roster,
    stop: StopFlag,
    /// Whether everybody has been there once.
    joined: bool,
    /// Robots that the present tick waits for; kept for its memory alone.
    awaited: Vec<usize>,
}

/// A squad on loan for one trial: see [`Lockstep::trial`].
#[derive(Debug)]
pub struct Trial<'a> {
    squad: &'a mut Lockstep,
    scenario: &'a Scenario,
}

impl Lockstep {
    /// Opens the run to agents. Once `stop` is raised, no silent agent is waited for.
    pub fn open(scenario: &Scenario, host: HostConfig, stop: StopFlag) -> Result<Self, SquadError> {
        Ok(Self {
            members: Roster::open(scenario, Mode::Lockstep, host)?,
            stop,
            joined: false,
            awaited: Vec::new(),
        })
    }

    /// Plays one trial of `scenario` after another by the same agents: once it has been joined, the squad
    /// is not dismissed but begins anew. Between two trials it must be whole, and have as many robots.
    pub fn trial<'a>(&'a mut self, scenario: &'a Scenario) -> Trial<'a> {
        Trial { squad: self, scenario }
    }

    fn await_joining(
        &mut self,
        reborn: Vec<usize>,
        tick: Tick,
        answers: &mut Answers,
    ) -> Result<(), SquadError> {
        if reborn.is_empty() {
            return Ok(());
        }
        self.members.doorbell.expect(reborn.len() as u32);
        self.members.await_joining(&reborn, tick, &self.stop, answers)
    }

    /// Waits for the answers of `missing`, and deals with those that do not come.
    fn await_answers(
        &mut self,
        missing: &mut Vec<usize>,
        tick: Tick,
        answers: &mut Answers,
    ) -> Result<(), SquadError> {
        let rung = Moment::now();
        // Late twice in a row: after somebody has stopped all processes the first look comes too early.
        let mut was_late = false;
        loop {
            let announced = self.members.doorbell.wait_for_answers(ALIVE_POLL);
            self.collect(missing, tick, answers)?;
            if missing.is_empty() || self.stop.is_raised() {
                self.members.nobody_is_waited_for();
                return Ok(());
            }
            self.members.wait_for(Awaited::Answer, missing, tick, rung);
            let late = rung.elapsed() > self.members.hang_timeout;
            let mut waited_for = Vec::new();
            for &index in &*missing {
                if was_late && late {
                    self.members.give_up_on(index, tick)?;
                } else if !self.members.bury_if_dead(index, tick)? {
                    waited_for.push(index);
                }
            }
            *missing = waited_for;
            was_late = late;
            if announced {
                thread::sleep(EARLY_RING);
            }
        }
    }

    /// Reads the uplinks of `missing`, where those stay who have not answered.
    fn collect(
        &mut self,
        missing: &mut Vec<usize>,
        tick: Tick,
        answers: &mut Answers,
    ) -> Result<(), SquadError> {
        let mut silent = 0;
        for at in 0..missing.len() {
            let index = missing[at];
            match self.members.hear(index, tick..=tick)? {
                Heard::Command(_, command) => answers[index] = Some(command),
                Heard::Refused => answers[index] = None,
                Heard::Nothing => {
                    missing[silent] = index;
                    silent += 1;
                }
            }
        }
        missing.truncate(silent);
        Ok(())
    }
}

impl Squad for Lockstep {
    fn join_all(&mut self, stop: &StopFlag) -> Result<Answers, SquadError> {
        self.joined = true;
        self.members.join_all(stop)
    }

    /// Waits for every new life.
    fn apply_process_faults(
        &mut self,
        tick: Tick,
        process_faults: &[ProcessFault],
        answers: &mut Answers,
    ) -> Result<(), SquadError> {
        let mut reborn = Vec::new();
        for &process_fault in process_faults {
            if process_fault.action == ProcessAction::Pause {
                // A new life is there before it is paused, so that it takes part right after.
                self.await_joining(mem::take(&mut reborn), tick, answers)?;
            }
            if self.members.apply_process_faults(process_fault, answers)?
                && process_fault.action == ProcessAction::Restart
            {
                reborn.push(process_fault.robot as usize);
            }
        }
        self.await_joining(reborn, tick, answers)
    }

    fn left_out(&self) -> Vec<u32> {
        self.members.left_out()
    }

    fn exchange(&mut self, percepts: &[Percept], answers: &mut Answers) -> Result<(), SquadError> {
        let tick = percepts.first().map_or(0, |percept| percept.tick);
        answers.fill(None);
        self.members.recorder.iter_mut().for_each(|recorder| recorder.begin_round(tick));
        let mut awaited = mem::take(&mut self.awaited);
        self.members.send(percepts, &mut awaited)?;
        self.members.doorbell.expect(awaited.len() as u32);
        self.members.ring();
        self.await_answers(&mut awaited, tick, answers)?;
        self.awaited = awaited;
        self.members.welcome(tick, answers)
    }

    fn profile(&mut self) -> Option<Profile> {
        self.members.profile()
    }

    fn live(&self) -> Option<Arc<Live>> {
        self.members.live()
    }

    fn status_of_robots(&mut self, watched: bool) -> SquadStatus {
        self.members.status_of_robots(watched)
    }

    fn notes(&self, index: usize) -> &Notes {
        &self.members.members[index].notes
    }

    fn dismiss(&mut self) {
        self.members.dismiss();
    }

    fn robot_statuses(&self) -> Vec<RobotStatus> {
        self.members.robot_statuses()
    }

    fn incidents(&self) -> &[Incident] {
        self.members.incidents()
    }
}

impl Squad for Trial<'_> {
    fn join_all(&mut self, stop: &StopFlag) -> Result<Answers, SquadError> {
        match self.squad.joined {
            true => self.squad.members.rejoin_all(self.scenario, Mode::Lockstep, stop),
            false => self.squad.join_all(stop),
        }
    }

    fn apply_process_faults(
        &mut self,
        tick: Tick,
        process_faults: &[ProcessFault],
        answers: &mut Answers,
    ) -> Result<(), SquadError> {
        self.squad.apply_process_faults(tick, process_faults, answers)
    }

    fn left_out(&self) -> Vec<u32> {
        self.squad.left_out()
    }

    fn exchange(&mut self, percepts: &[Percept], answers: &mut Answers) -> Result<(), SquadError> {
        self.squad.exchange(percepts, answers)
    }

    fn status_of_robots(&mut self, watched: bool) -> SquadStatus {
        self.squad.status_of_robots(watched)
    }

    fn notes(&self, index: usize) -> &Notes {
        self.squad.notes(index)
    }

    /// The next trial needs them.
    fn dismiss(&mut self) {}

    fn robot_statuses(&self) -> Vec<RobotStatus> {
        self.squad.robot_statuses()
    }

    fn incidents(&self) -> &[Incident] {
        self.squad.incidents()
    }
}

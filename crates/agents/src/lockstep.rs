//! Processes in lock-step: the arena waits for every live agent, every tick.

use std::{mem, thread, time::Duration};

use profile::CycleTimes;
use protocol::{
    notes::Notes,
    percept::{Percept, Tick},
    property::Property,
    robot_id::RobotId,
    setup::Mode,
};
use scenario::{ProcessAction, ProcessFault, Scenario};
use squad::{
    Answers, Awaited, Incident, RobotStatus, Squad, SquadError, WaitingSink, moment::Moment, stop::StopFlag,
};
use transport::raw::BOOT_TICK;

use crate::{
    member::Heard,
    roster::{HostConfig, Roster},
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
    /// Whether agents stay when a run has ended: another trial begins.
    stays: bool,
    /// The tick that percepts were sent for last.
    tick: Tick,
    /// Robots that it waits for.
    awaited: Vec<usize>,
}

impl Lockstep {
    /// Opens the run to agents. Once `stop` is raised, no silent agent is waited for.
    pub fn open(scenario: &Scenario, host: HostConfig, stop: StopFlag) -> Result<Self, SquadError> {
        Ok(Self {
            members: Roster::open(scenario, Mode::Lockstep, host)?,
            stop,
            joined: false,
            stays: false,
            tick: 0,
            awaited: Vec::new(),
        })
    }

    /// Opens a run of trials, the first of `scenario`: when one has ended, the agents stay for the next, until they are
    /// [told to leave](Self::end).
    pub fn open_for_trials(
        scenario: &Scenario,
        host: HostConfig,
        stop: StopFlag,
    ) -> Result<Self, SquadError> {
        Ok(Self { stays: true, ..Self::open(scenario, host, stop)? })
    }

    /// Has the agents begin anew for a trial of `scenario`, which has as many robots as the last. They must all be there, in
    /// their first life.
    pub fn begin_anew(&mut self, scenario: &Scenario) -> Result<(), SquadError> {
        self.members.begin_anew(scenario, Mode::Lockstep)
    }

    /// Ends the run of trials.
    pub fn end(&mut self) {
        self.members.dismiss();
    }

    /// Waits for every new life, planned or not, as long as a first one: it takes part from the next tick on.
    fn await_reborn(
        &mut self,
        tick: Tick,
        answers: &mut Answers,
        waiting: &mut WaitingSink<'_>,
    ) -> Result<(), SquadError> {
        self.members.doorbell.expect(self.members.expected().len() as u32);
        self.members.await_joining(tick, &self.stop, answers, waiting)
    }

    /// Waits for the answers of `missing`, and deals with those that do not come: in the end and in the order of robots,
    /// whichever was noticed first.
    fn await_answers(
        &mut self,
        missing: &mut Vec<usize>,
        tick: Tick,
        answers: &mut Answers,
        waiting: &mut WaitingSink<'_>,
    ) -> Result<(), SquadError> {
        let rung = Moment::now();
        // Late twice in a row: after somebody has stopped all processes the first look comes too early.
        let mut was_late = false;
        let mut lost: Vec<(usize, String)> = Vec::new();
        loop {
            let announced = self.members.doorbell.wait_for_answers(ALIVE_POLL);
            self.read(missing, tick, answers)?;
            if missing.is_empty() || self.stop.is_raised() {
                self.members.nobody_is_waited_for(waiting);
                break;
            }
            self.members.wait_for(Awaited::Answer, missing, tick, rung, waiting);
            let late = rung.elapsed() > self.members.hang_timeout;
            self.members.note_exits();
            let mut waited_for = Vec::new();
            for &index in &*missing {
                if self.members.is_gone(index) {
                    // It may have answered before it died.
                    if !self.take(index, tick, answers)? {
                        lost.push((index, self.members.death(index, tick)));
                    }
                } else if was_late && late {
                    lost.push((index, self.members.hanging(index, tick)));
                } else {
                    waited_for.push(index);
                }
            }
            *missing = waited_for;
            was_late = late;
            if announced {
                thread::sleep(EARLY_RING);
            }
        }
        lost.sort();
        lost.into_iter().try_for_each(|(index, what)| self.members.apply_hang_policy(index, tick, what))
    }

    /// Reads the uplinks of `missing`, where those stay who have not answered.
    fn read(
        &mut self,
        missing: &mut Vec<usize>,
        tick: Tick,
        answers: &mut Answers,
    ) -> Result<(), SquadError> {
        let mut silent = 0;
        for at in 0..missing.len() {
            let index = missing[at];
            if !self.take(index, tick, answers)? {
                missing[silent] = index;
                silent += 1;
            }
        }
        missing.truncate(silent);
        Ok(())
    }

    /// Takes in what agent `index` has answered to `tick`. Returns whether it has.
    fn take(&mut self, index: usize, tick: Tick, answers: &mut Answers) -> Result<bool, SquadError> {
        answers[index] = match self.members.hear(index, tick..=tick)? {
            Heard::Command(_, command) => Some(command),
            Heard::Refused => None,
            Heard::Nothing => return Ok(false),
        };
        Ok(true)
    }
}

impl Squad for Lockstep {
    fn join_all(
        &mut self,
        answers: &mut Answers,
        stop: &StopFlag,
        waiting: &mut WaitingSink<'_>,
    ) -> Result<(), SquadError> {
        match mem::replace(&mut self.joined, true) {
            false => self.members.join_all(answers, stop, waiting),
            true => self.members.await_joining(BOOT_TICK, stop, answers, waiting),
        }
    }

    /// Waits for every new life.
    fn apply_process_faults(
        &mut self,
        tick: Tick,
        process_faults: &[ProcessFault],
        answers: &mut Answers,
        waiting: &mut WaitingSink<'_>,
    ) -> Result<(), SquadError> {
        let mut restarts = false;
        for &process_fault in process_faults {
            if process_fault.action == ProcessAction::Pause && restarts {
                // A new life is there before it is paused, so that it takes part right after.
                self.await_reborn(tick, answers, waiting)?;
            }
            self.members.apply_process_faults(process_fault, answers)?;
            restarts |= process_fault.action == ProcessAction::Restart;
        }
        match restarts {
            true => self.await_reborn(tick, answers, waiting),
            false => Ok(()),
        }
    }

    fn left_out(&self) -> Vec<u32> {
        self.members.left_out()
    }

    fn send(&mut self, percepts: &[Percept]) -> Result<(), SquadError> {
        self.tick = percepts.first().map_or(0, |percept| percept.tick);
        self.members.recorder.iter_mut().for_each(|recorder| recorder.begin_round(self.tick));
        self.members.send(percepts, &mut self.awaited)?;
        self.members.doorbell.expect(self.awaited.len() as u32);
        self.members.ring();
        Ok(())
    }

    fn collect(&mut self, answers: &mut Answers, waiting: &mut WaitingSink<'_>) -> Result<(), SquadError> {
        answers.fill(None);
        let mut awaited = mem::take(&mut self.awaited);
        self.await_answers(&mut awaited, self.tick, answers, waiting)?;
        self.awaited = awaited;
        match self.members.welcome(self.tick, answers)? {
            true => self.await_reborn(self.tick, answers, waiting),
            false => Ok(()),
        }
    }

    fn now_ns(&self) -> Option<u64> {
        self.members.recorder.as_ref()?.now_ns()
    }

    fn take_cycles(&mut self, cycles: &mut Vec<CycleTimes>) {
        self.members.recorder.iter_mut().for_each(|recorder| recorder.take_cycles(cycles));
    }

    fn take_incidents(&mut self, incidents: &mut Vec<Incident>) {
        self.members.take_incidents(incidents);
    }

    fn notes(&self, robot: u32) -> Option<&Notes> {
        self.members.notes(robot)
    }

    fn take_properties(&mut self) -> Vec<(RobotId, Vec<Property>)> {
        self.members.take_properties()
    }

    fn robot_statuses(&self) -> Vec<RobotStatus> {
        self.members.robot_statuses()
    }

    fn dismiss(&mut self) {
        if !self.stays {
            self.members.dismiss();
        }
    }
}

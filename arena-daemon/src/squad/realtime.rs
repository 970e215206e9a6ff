//! Processes on their own timers: the arena takes in what comes as it comes, and waits for nobody.

use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use arena::fault::ProcessFault;
use protocol::{
    command::Answer,
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

/// A command stands for this many neighbor cycles if no newer one comes: agents' timers drift
/// against the arena's, so that a cycle may see no command of an agent and the next one two. After
/// that the robot stands still and is silent.
const HOLD_CYCLES: u64 = 3;

/// A robot not heard for longer than this, and than two cycles, is named to those who watch.
const SILENT: Duration = Duration::from_millis(500);

/// The arena looks every cycle; when this much more time has passed, it was itself away.
const ABSENCE: Duration = Duration::from_millis(500);

/// Agents that answer when they get to it.
#[derive(Debug)]
pub struct Realtime {
    members: Roster,
    latest: Vec<Option<Latest>>,
    /// How often percepts have been exchanged: once per neighbor cycle.
    cycles: u64,
    /// Length of a cycle.
    cycle: Duration,
    /// When the arena last looked.
    looked: Moment,
    /// The tick of the last percepts.
    tick: Tick,
}

/// The last command of one agent.
#[derive(Clone, Copy, Debug)]
struct Latest {
    answer: Answer,
    /// The tick it answers; `None` for the command given at boot.
    answers: Option<Tick>,
    /// In which cycle it came; `None` once a newer answer was refused, or the robot was paused: then
    /// it stands still.
    stands_since: Option<u64>,
    arrived: Moment,
}

impl Realtime {
    /// Opens the run to agents.
    pub fn open(scenario: &Scenario, host: HostConfig) -> Result<Self, SquadError> {
        let members = Roster::open(scenario, Mode::Realtime, host)?;
        let latest = vec![None; scenario.robot_count() as usize];
        let cycle = Duration::from_secs_f64(scenario.cycle_s());
        Ok(Self { members, latest, cycles: 0, cycle, looked: Moment::now(), tick: 0 })
    }

    /// Takes in the newest command of agent `index`, if a new one has come.
    fn hear(&mut self, index: usize, tick: Tick) -> Result<(), SquadError> {
        let next = self.latest[index].and_then(|latest| latest.answers).map_or(0, |answered| answered + 1);
        match self.members.hear(index, next..=tick.max(next))? {
            Heard::Command(tick, answer) => self.note(index, Some(tick), answer),
            Heard::Refused => {
                if let Some(latest) = &mut self.latest[index] {
                    (latest.stands_since, latest.arrived) = (None, Moment::now());
                }
            }
            Heard::Nothing => {}
        }
        Ok(())
    }

    /// If the arena itself was away (stopped, or starved), nobody is to blame for that time.
    fn forgive_own_absence(&mut self) {
        let away = self.looked.elapsed();
        self.looked = Moment::now();
        if away > self.cycle + ABSENCE {
            self.latest.iter_mut().flatten().for_each(|latest| latest.arrived += away);
        }
    }

    fn note(&mut self, index: usize, answers: Option<Tick>, answer: Answer) {
        let (stands_since, arrived) = (Some(self.cycles), Moment::now());
        self.latest[index] = Some(Latest { answer, answers, stands_since, arrived });
    }
}

impl Squad for Realtime {
    fn join_all(&mut self, stop: &StopFlag) -> Result<Answers, SquadError> {
        let answers = self.members.join_all(stop)?;
        for (index, answer) in answers.iter().enumerate() {
            if let Some(answer) = answer {
                self.note(index, None, *answer);
            }
        }
        Ok(answers)
    }

    /// Waits for nobody: who begins a new life takes part once it is there.
    fn apply_process_faults(
        &mut self,
        _: Tick,
        process_faults: &[ProcessFault],
        answers: &mut Answers,
    ) -> Result<(), SquadError> {
        for &process_fault in process_faults {
            let struck = self.members.apply_process_faults(process_fault, answers)?;
            if let Some(latest) = self.latest[process_fault.robot as usize].as_mut().filter(|_| struck) {
                // What it has said no longer stands; a pause is no silence to be blamed for.
                (latest.stands_since, latest.arrived) = (None, Moment::now());
            }
        }
        Ok(())
    }

    fn left_out(&self) -> Vec<u32> {
        self.members.left_out()
    }

    fn exchange(&mut self, percepts: &[Percept], answers: &mut Answers) -> Result<(), SquadError> {
        let tick = percepts.first().map_or(0, |percept| percept.tick);
        self.tick = tick;
        self.forgive_own_absence();
        answers.fill(None);
        self.members.recorder.iter_mut().for_each(|recorder| recorder.begin_round(tick));
        let mut present = Vec::with_capacity(percepts.len());
        self.members.send(percepts, &mut present)?;
        self.members.ring();
        for index in present {
            self.hear(index, tick)?;
            let Some(latest) = self.latest[index] else { continue };
            if latest.arrived.elapsed() > self.members.hang_timeout {
                self.latest[index] = None;
                self.members.give_up_on(index, tick)?;
            } else if latest.stands_since.is_some_and(|since| self.cycles <= since + HOLD_CYCLES) {
                answers[index] = Some(latest.answer);
            }
        }
        self.members.welcome(tick, answers)?;
        for (index, answer) in answers.iter_mut().enumerate() {
            let life = self.members.life(index);
            let speaks = |answer: &Answer| Some(answer.sender) == life;
            // What an ended life has said no longer stands; what a new one says first, does.
            self.latest[index] = self.latest[index].filter(|latest| speaks(&latest.answer));
            *answer = answer.filter(speaks);
            if let (Some(answer), None) = (*answer, self.latest[index]) {
                self.note(index, None, answer);
            }
        }
        self.cycles += 1;
        Ok(())
    }

    /// Answers are taken in when they are there, so that what they took is known; they count from the next tick on.
    fn poll_until(&mut self, due: Instant) -> Result<(), SquadError> {
        let mut signed = Vec::with_capacity(self.latest.len());
        loop {
            // First, so that an answer that comes while others are taken in is not slept through.
            self.members.doorbell.expect(1);
            signed.clear();
            signed.extend(self.members.doorbell.signed());
            for &robot in &signed {
                if self.members.is_present(robot as usize) {
                    self.hear(robot as usize, self.tick)?;
                }
            }
            let left = due.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Ok(());
            }
            self.members.doorbell.wait_for_answers(left);
        }
    }

    fn profile(&mut self) -> Option<Profile> {
        self.members.profile()
    }

    fn live(&self) -> Option<Arc<Live>> {
        self.members.live()
    }

    fn status_of_robots(&mut self, watched: bool) -> SquadStatus {
        let silent = (0..).zip(&self.latest).filter_map(|(index, latest)| {
            let since = latest.as_ref()?.arrived;
            (self.members.is_present(index) && since.elapsed() > SILENT.max(2 * self.cycle))
                .then_some((index, since))
        });
        let waiting = self.members.waiting(Awaited::Sign, silent, self.tick);
        SquadStatus { waiting, ..self.members.status_of_robots(watched) }
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

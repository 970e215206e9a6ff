//! Processes on their own timers: the arena takes in what comes as it comes, and waits for nobody.

use std::{
    mem,
    time::{Duration, Instant},
};

use profile::CycleTimes;
use protocol::{
    command::Answer,
    notes::Notes,
    percept::{Percept, Tick},
    property::Property,
    robot_id::RobotId,
    setup::Mode,
};
use scenario::{ProcessFault, Scenario};
use squad::{
    Answers, Awaited, Incident, RobotStatus, Squad, SquadError, WaitingSink, moment::Moment, stop::StopFlag,
};

use crate::{
    member::Heard,
    roster::{HostConfig, Roster},
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
    /// Robots that they were sent to.
    present: Vec<usize>,
}

/// The last words of one agent.
#[derive(Clone, Debug)]
struct Latest {
    /// The life that said it.
    life: RobotId,
    /// The tick of the newest command that was taken in; `None` for the one given at boot.
    answers: Option<Tick>,
    /// The command that counts, and in which cycle it came; `None` once a newer one was refused, or the robot was
    /// paused: then it stands still.
    standing: Option<(Answer, u64)>,
    arrived: Moment,
}

impl Realtime {
    /// Opens the run to agents.
    pub fn open(scenario: &Scenario, host: HostConfig) -> Result<Self, SquadError> {
        let members = Roster::open(scenario, Mode::Realtime, host)?;
        let latest = vec![None; scenario.robot_count() as usize];
        let cycle = Duration::from_secs_f64(scenario.cycle_s());
        Ok(Self { members, latest, cycles: 0, cycle, looked: Moment::now(), tick: 0, present: Vec::new() })
    }

    /// Takes in the newest command of agent `index`, if a new one has come.
    fn hear(&mut self, index: usize, tick: Tick) -> Result<(), SquadError> {
        let next =
            self.latest[index].as_ref().and_then(|latest| latest.answers).map_or(0, |answered| answered + 1);
        match self.members.hear(index, next..=tick.max(next))? {
            Heard::Command(tick, answer) => self.note(index, answer.sender, Some(tick), Some(answer)),
            Heard::Refused => {
                if let Some(latest) = &mut self.latest[index] {
                    (latest.standing, latest.arrived) = (None, Moment::now());
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

    fn note(&mut self, index: usize, life: RobotId, answers: Option<Tick>, answer: Option<Answer>) {
        let standing = answer.map(|answer| (answer, self.cycles));
        self.latest[index] = Some(Latest { life, answers, standing, arrived: Moment::now() });
    }

    /// Forgets lives that are over, with what they have said, and takes note of those that have joined.
    fn note_lives(&mut self, answers: &mut Answers) {
        for (index, answer) in answers.iter_mut().enumerate() {
            let life = self.members.life(index);
            self.latest[index].take_if(|latest| Some(latest.life) != life);
            answer.take_if(|answer| Some(answer.sender) != life);
            if let (Some(life), None) = (life, &self.latest[index]) {
                self.note(index, life, None, answer.clone());
            }
        }
    }

    /// Names robots that have not been heard for too long to those who watch.
    fn tell_of_silent(&mut self, waiting: &mut WaitingSink<'_>) {
        let Self { members, latest, cycle, tick, .. } = self;
        let patience = SILENT.max(2 * *cycle);
        let silent: Vec<(usize, Moment)> = (0..)
            .zip(&*latest)
            .filter_map(|(index, latest)| Some((index, latest.as_ref()?.arrived)))
            .filter(|&(index, since)| members.is_present(index) && since.elapsed() > patience)
            .collect();
        members.tell_of(Awaited::Sign, || silent, *tick, waiting);
    }
}

impl Squad for Realtime {
    fn join_all(
        &mut self,
        answers: &mut Answers,
        stop: &StopFlag,
        waiting: &mut WaitingSink<'_>,
    ) -> Result<(), SquadError> {
        self.members.join_all(answers, stop, waiting)?;
        self.note_lives(answers);
        Ok(())
    }

    /// Waits for nobody: who begins a new life takes part once it is there.
    fn apply_process_faults(
        &mut self,
        _: Tick,
        process_faults: &[ProcessFault],
        answers: &mut Answers,
        _: &mut WaitingSink<'_>,
    ) -> Result<(), SquadError> {
        for &process_fault in process_faults {
            let struck = self.members.apply_process_faults(process_fault, answers)?;
            if let Some(latest) = self.latest[process_fault.robot as usize].as_mut().filter(|_| struck) {
                // What it has said no longer stands; a pause is no silence to be blamed for.
                (latest.standing, latest.arrived) = (None, Moment::now());
            }
        }
        Ok(())
    }

    fn left_out(&self) -> Vec<u32> {
        self.members.left_out()
    }

    fn send(&mut self, percepts: &[Percept]) -> Result<(), SquadError> {
        self.tick = percepts.first().map_or(0, |percept| percept.tick);
        self.forgive_own_absence();
        self.members.recorder.iter_mut().for_each(|recorder| recorder.begin_round(self.tick));
        self.members.send(percepts, &mut self.present)?;
        self.members.ring();
        Ok(())
    }

    fn collect(&mut self, answers: &mut Answers, waiting: &mut WaitingSink<'_>) -> Result<(), SquadError> {
        answers.fill(None);
        let tick = self.tick;
        self.members.note_exits();
        for index in mem::take(&mut self.present) {
            self.hear(index, tick)?;
            // Asked of those that are silent alone: it costs a look at the process.
            let is_silent = self.latest[index].as_ref().is_none_or(|it| it.arrived.elapsed() > self.cycle);
            if is_silent && self.members.is_gone(index) {
                let what = self.members.death(index, tick);
                self.members.apply_hang_policy(index, tick, what)?;
                continue;
            }
            let Some(latest) = &self.latest[index] else { continue };
            if latest.arrived.elapsed() > self.members.hang_timeout {
                self.latest[index] = None;
                let what = self.members.hanging(index, tick);
                self.members.apply_hang_policy(index, tick, what)?;
            } else if let Some((answer, since)) = &latest.standing
                && self.cycles <= since + HOLD_CYCLES
            {
                answers[index] = Some(answer.clone());
            }
        }
        self.members.welcome(tick, answers)?;
        self.note_lives(answers);
        self.cycles += 1;
        self.tell_of_silent(waiting);
        Ok(())
    }

    /// Answers are taken in when they are there, so that what they took is known; they count from the next tick on.
    fn poll_until(&mut self, due: Instant, _: &mut WaitingSink<'_>) -> Result<(), SquadError> {
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
        self.members.dismiss();
    }
}

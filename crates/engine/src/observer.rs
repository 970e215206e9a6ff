//! The trait of whoever watches a run, and what it is shown.

use std::{cell::OnceCell, mem, time::Duration};

use arena::{
    Arena,
    fault::ledger::Line,
    frame::Pose,
    losses::Loss,
    metrics::{Attendance, Disturbance, EstimatedErrors, Metrics},
    packets::Packets,
};
use profile::CycleTimes;
use protocol::{
    command::Answer,
    notes::Notes,
    percept::{Percept, Tick},
    setup::Mode,
};
use scenario::{FieldSpec, ProcessFault, Scenario};
use squad::{Incident, RobotStatus, Squad, Waiting};

use crate::summary::Summary;

/// Receives what happens in a run. Every method defaults to nothing.
///
/// An observer changes nothing: a run goes the same way whoever watches. One that fails is told no more, the run goes
/// on, and its summary says so.
pub trait Observer {
    /// All robots have joined, and the first tick is about to begin.
    ///
    /// # Errors
    /// If the observer cannot go on.
    fn started(&mut self, run: &RunInfo<'_>) -> Result<(), ObserverError> {
        let _ = run;
        Ok(())
    }

    /// `tick` begins, in which the fault plan does this to agents.
    fn tick_begins(&mut self, tick: Tick, process_faults: &[ProcessFault]) {
        let _ = (tick, process_faults);
    }

    /// A tick has passed, and robots have answered its percepts.
    ///
    /// # Errors
    /// If the observer cannot go on; or if it objects to what it has seen, which ends the run.
    fn ticked(&mut self, tick: &TickView<'_>) -> Result<(), ObserverError> {
        let _ = tick;
        Ok(())
    }

    /// The run waits for robots, or does not any more. Told some ten times a second while it waits, from joining on.
    fn waiting(&mut self, waiting: Option<&Waiting>) {
        let _ = waiting;
    }

    /// Whole cycles of agents are known, those of a robot in their order; of the robots that were asked for when the
    /// squad was made.
    fn cycles(&mut self, cycles: &[CycleTimes]) {
        let _ = cycles;
    }

    /// Whether it wants to see which packets are lost ([`TickView::losses`]). Asked before each tick.
    fn wants_losses(&self) -> bool {
        false
    }

    /// Somebody has acted upon the run, before the tick at which it takes effect.
    fn acted(&mut self, acted: &Acted<'_>) {
        let _ = acted;
    }

    /// Something unplanned has happened to a robot.
    fn incident(&mut self, incident: &Incident) {
        let _ = incident;
    }

    /// The run is over and its agents are dismissed: adds what this observer knows to the summary. `end` shows the last
    /// tick.
    ///
    /// # Errors
    /// If it could not be kept whole.
    fn summarize(&mut self, end: &TickView<'_>, summary: &mut Summary) -> Result<(), ObserverError> {
        let _ = (end, summary);
        Ok(())
    }

    /// The summary is complete.
    ///
    /// # Errors
    /// If it could not be kept whole.
    fn finished(&mut self, end: &TickView<'_>, summary: &Summary) -> Result<(), ObserverError> {
        let _ = (end, summary);
        Ok(())
    }
}

/// Reason why an observer is told no more, or the run does not go on.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ObserverError {
    /// The observer cannot go on. It ends alone.
    #[error("{0}")]
    Broken(String),
    /// The observer has seen what must not be. The run ends, and has failed.
    #[error("{0}")]
    Objection(String),
}

/// Facts about a run that do not change.
#[derive(Clone, Copy, Debug)]
pub struct RunInfo<'a> {
    /// The scenario.
    pub scenario: &'a Scenario,
    /// Name of the engine.
    pub engine: &'a str,
    /// How time passes.
    pub mode: Mode,
    /// Virtual over real time at most; `None` for as fast as it can.
    pub speed: Option<f64>,
}

/// An act upon the run.
#[derive(Clone, Copy, Debug)]
pub struct Acted<'a> {
    /// The tick that it takes effect at.
    pub tick: Tick,
    /// The act, in words.
    pub what: &'a str,
    /// The scenario as it is from now on, if the act has changed its fault plan.
    pub scenario: Option<&'a Scenario>,
    /// Whether ticks are held back.
    pub is_held: bool,
    /// Virtual over real time at most; `None` for as fast as it can.
    pub speed: Option<f64>,
}

/// Moments of a tick by the clock that agents are measured by, nanoseconds since all had joined.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TickStamps {
    /// The tick began.
    pub began_ns: u64,
    /// Percepts were ready; `None` if no neighbor cycle began.
    pub ready_ns: Option<u64>,
    /// They had been sent.
    pub sent_ns: Option<u64>,
    /// Answers had been taken in.
    pub answered_ns: Option<u64>,
    /// The tick was over, or the run was.
    pub ended_ns: u64,
}

/// One tick of a run, as observers see it. What costs time is worked out when somebody asks, and once.
pub struct TickView<'a> {
    pub(crate) scenario: &'a Scenario,
    pub(crate) arena: &'a Arena,
    pub(crate) squad: &'a dyn Squad,
    pub(crate) answers: &'a [Option<Answer>],
    pub(crate) errors: EstimatedErrors,
    pub(crate) took: Duration,
    pub(crate) stamps: Option<TickStamps>,
    pub(crate) is_last: bool,
    pub(crate) metrics: OnceCell<Metrics>,
}

/// Counts the robots of `squad` that are there.
pub(crate) fn attendance(squad: &dyn Squad) -> Attendance {
    let robots = squad.robot_statuses();
    let count =
        |is_meant: fn(&RobotStatus) -> bool| robots.iter().filter(|robot| is_meant(robot)).count() as u32;
    Attendance { alive: count(RobotStatus::is_alive), paused: count(RobotStatus::is_paused) }
}

impl TickView<'_> {
    /// Returns the scenario of the run.
    pub fn scenario(&self) -> &Scenario {
        self.scenario
    }

    /// Returns the tick that has passed; 0 if none has.
    pub fn tick(&self) -> Tick {
        self.arena.current_tick()
    }

    /// Returns the number of the last tick, if the run is not cut short.
    pub fn ticks(&self) -> Tick {
        self.scenario.ticks()
    }

    /// Returns the virtual time, seconds.
    pub fn time_s(&self) -> f64 {
        self.arena.time_s()
    }

    /// Whether the run ends with this tick.
    pub fn is_last(&self) -> bool {
        self.is_last
    }

    /// Whether this tick is one of those that come every so many, or the last.
    pub fn is_due(&self, every_ticks: u64) -> bool {
        self.is_last || self.tick().is_multiple_of(every_ticks)
    }

    /// Returns the pose of every robot, by index.
    pub fn poses(&self) -> &[Pose] {
        self.arena.poses()
    }

    /// Returns the field of this tick: that of the scenario, and what has changed of it since.
    pub fn field_spec(&self) -> &FieldSpec {
        self.arena.field_spec()
    }

    /// Returns the percepts of this tick, by robot; `None` if no neighbor cycle began.
    pub fn percepts(&self) -> Option<&[Percept]> {
        self.arena.percepts()
    }

    /// Returns each robot's command in force; `None` of a silent one.
    pub fn answers(&self) -> &[Option<Answer>] {
        self.answers
    }

    /// Returns the status of every robot's agent, by index.
    pub fn robots(&self) -> Vec<RobotStatus> {
        self.squad.robot_statuses()
    }

    /// Returns what a robot notes for those who watch, with its last answer; `None` if there is no such robot.
    pub fn notes(&self, robot: u32) -> Option<&Notes> {
        self.squad.notes(robot)
    }

    /// Returns the errors that robots estimate.
    pub fn errors(&self) -> EstimatedErrors {
        self.errors
    }

    /// Returns the metrics of the swarm.
    pub fn metrics(&self) -> &Metrics {
        self.metrics.get_or_init(|| self.arena.metrics(self.answers, attendance(self.squad)))
    }

    /// Returns the quantities in which faults can be felt: less work than all metrics.
    pub fn disturbance(&self) -> Disturbance {
        self.arena.disturbance(self.answers)
    }

    /// Returns the packets since the start, by fate.
    pub fn packets(&self) -> Packets {
        self.arena.packets()
    }

    /// Returns the packets that were not heard since the neighbor cycle before; none unless an observer wants them.
    pub fn losses(&self) -> &[Loss] {
        self.arena.losses()
    }

    /// Returns a number for each robot that says what the digest takes in of it in this tick.
    pub fn hashes(&self) -> Vec<u64> {
        self.arena.hashes()
    }

    /// Returns how many packets each robot has heard since the start.
    pub fn heard(&self) -> &[u64] {
        self.arena.heard()
    }

    /// Returns the ledger of all faults.
    pub fn ledger(&self) -> impl Iterator<Item = &Line> {
        self.arena.ledger()
    }

    /// Returns how long the tick took.
    pub fn took(&self) -> Duration {
        self.took
    }

    /// Returns its moments by the agents' clock; `None` if nobody measures agents, or no tick has begun.
    pub fn stamps(&self) -> Option<TickStamps> {
        self.stamps
    }
}

/// The observers of a run, as long as each of them can go on.
pub(crate) struct Observers<'a, 'o> {
    active: Vec<&'a mut (dyn Observer + 'o)>,
    failures: Vec<String>,
    objection: Option<String>,
}

impl<'a, 'o> Observers<'a, 'o> {
    pub(crate) fn new(observers: &'a mut [&mut (dyn Observer + 'o)]) -> Self {
        let active = observers.iter_mut().map(|observer| &mut **observer).collect();
        Self { active, failures: Vec::new(), objection: None }
    }

    /// Tells each of them; one that fails is told no more.
    pub(crate) fn try_each(&mut self, mut tell: impl FnMut(&mut dyn Observer) -> Result<(), ObserverError>) {
        let Self { active, failures, objection } = self;
        active.retain_mut(|observer| match tell(*observer) {
            Ok(()) => true,
            Err(ObserverError::Objection(what)) => {
                objection.get_or_insert(what);
                true
            }
            Err(ObserverError::Broken(what)) => {
                failures.push(what);
                false
            }
        });
    }

    /// Whether one of them wants to see which packets are lost.
    pub(crate) fn want_losses(&self) -> bool {
        self.active.iter().any(|observer| observer.wants_losses())
    }

    pub(crate) fn each(&mut self, mut tell: impl FnMut(&mut dyn Observer)) {
        for observer in &mut self.active {
            tell(*observer);
        }
    }

    /// Tells of incidents and cycles that have come.
    pub(crate) fn pass_on(&mut self, incidents: &[Incident], cycles: &[CycleTimes]) {
        self.each(|observer| incidents.iter().for_each(|incident| observer.incident(incident)));
        if !cycles.is_empty() {
            self.each(|observer| observer.cycles(cycles));
        }
    }

    /// Takes what an observer has objected to, if one has.
    pub(crate) fn objection(&mut self) -> Option<String> {
        self.objection.take()
    }

    /// Takes the words of those who have failed.
    pub(crate) fn failures(&mut self) -> Vec<String> {
        mem::take(&mut self.failures)
    }
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use protocol::{
        command::Command,
        controller::{Controller, StageObserver},
    };

    use super::*;
    use crate::{controller, run, summary::Ending};

    struct Beacon;

    impl Controller for Beacon {
        fn boot(&mut self) -> Command {
            Command::REST
        }

        fn step(&mut self, _: &Percept, _: &mut dyn StageObserver) -> Command {
            Command::REST
        }
    }

    /// Ends itself, or the run, at tick 3 by what it is given.
    struct Counting {
        ticks: u64,
        finished: bool,
        at_3: Option<ObserverError>,
    }

    impl Counting {
        fn new(at_3: Option<ObserverError>) -> Self {
            Self { ticks: 0, finished: false, at_3 }
        }
    }

    impl Observer for Counting {
        fn ticked(&mut self, tick: &TickView<'_>) -> Result<(), ObserverError> {
            self.ticks += 1;
            self.at_3.clone().filter(|_| tick.tick() == 3).map_or(Ok(()), Err)
        }

        fn finished(&mut self, _: &TickView<'_>, _: &Summary) -> Result<(), ObserverError> {
            self.finished = true;
            Ok(())
        }
    }

    fn watched(observers: &mut [&mut dyn Observer]) -> Summary {
        watched_with("", observers)
    }

    fn watched_with(faults: &str, observers: &mut [&mut dyn Observer]) -> Summary {
        let text = "duration_s = 1\nstep_s = 0.1\narena.size_m = [2, 1]\nrobots.count = 3\nchannel.range_m = 1\n\
                    [controller]\nprogram = [\"beacon\"]";
        let scenario = Scenario::parse("test", &format!("{text}\n{faults}"), &[]).unwrap();
        run(&scenario, &[&controller(|_, _| Ok::<_, Infallible>(Beacon))], observers).unwrap()
    }

    #[test]
    fn an_observer_that_fails_ends_alone_and_the_summary_says_so() {
        let broken = ObserverError::Broken("no room".into());
        let (mut failing, mut other) = (Counting::new(Some(broken)), Counting::new(None));
        let summary = watched(&mut [&mut failing, &mut other]);
        assert_eq!((failing.ticks, failing.finished, other.ticks, other.finished), (4, false, 11, true));
        assert_eq!(
            (summary.ended, summary.unwritten.clone()),
            (Ending::Finished, vec!["no room".to_owned()])
        );
        assert_eq!(summary.trouble().as_deref(), Some("no room"));
        assert_eq!(summary.digest, watched(&mut []).digest, "whoever watches");
    }

    /// Notes Φ, tick by tick.
    struct Lit(Vec<f64>);

    impl Observer for Lit {
        fn ticked(&mut self, tick: &TickView<'_>) -> Result<(), ObserverError> {
            self.0.push(tick.field_spec().offset.get());
            assert_eq!(tick.scenario().field_at(tick.tick()), *tick.field_spec());
            Ok(())
        }
    }

    #[test]
    fn an_observer_is_shown_the_field_as_it_is_by_then() {
        let mut lit = Lit(Vec::new());
        watched_with("[[fault]]\nkind = \"field\"\nat_s = 0.3\noffset = 2", &mut [&mut lit]);
        assert_eq!(lit.0, [[0.0; 3].as_slice(), &[2.0; 8]].concat());
    }

    #[test]
    fn an_observer_that_objects_ends_the_run() {
        let objection = ObserverError::Objection("a robot is outside".into());
        let (mut judge, mut other) = (Counting::new(Some(objection)), Counting::new(None));
        let summary = watched(&mut [&mut judge, &mut other]);
        assert_eq!((summary.ended, summary.ticks), (Ending::Failed, 3));
        assert_eq!(summary.failure.as_deref(), Some("a robot is outside"));
        assert_eq!((judge.ticks, other.ticks, judge.finished), (4, 4, true));
    }
}

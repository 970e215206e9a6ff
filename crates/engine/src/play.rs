//! The loop that every engine shares.

use std::{
    borrow::Cow,
    cell::OnceCell,
    time::{Duration, Instant},
};

use arena::{Arena, metrics::EstimatedErrors};
use hdrhistogram::Histogram;
use protocol::{command::Answer, setup::Mode};
use scenario::Scenario;
use squad::{
    Incident, RobotStatus, Squad, SquadError,
    moment::{Moment, Standstills},
    stop::StopFlag,
};

use crate::{
    act::{Act, Acts, Asked, Done, Hold, Refused},
    cores::Cores,
    observer::{Acted, Observer, Observers, RunInfo, TickStamps, TickView, attendance},
    pace::{Lag, Overload, Pace},
    properties::Properties,
    summary::{ActLine, Delivered, Ending, Fault, Recovered, Summary, TickTimes},
};

/// How the run is to be carried out.
#[derive(Clone, Copy, Debug)]
pub struct Plan {
    /// Name of the engine, for the summary.
    pub engine: &'static str,
    /// How time passes.
    pub mode: Mode,
    /// Cap on virtual over real time.
    pub speed: Option<f64>,
    /// Behavior if real time cannot be kept.
    pub overload: Overload,
    /// Whether the arena may use all cores: it is the only one at work.
    pub shares: bool,
}

impl Plan {
    /// As fast as it can in this process, by all its cores.
    pub const IN_PROCESS: Self = Self {
        engine: "in-process",
        mode: Mode::Lockstep,
        speed: None,
        overload: Overload::Report,
        shares: true,
    };

    /// Virtual over real time at most.
    fn factor(&self) -> Option<f64> {
        self.speed.or((self.mode == Mode::Realtime).then_some(1.0))
    }
}

/// Runs `scenario`, whose start `arena` is, to its end, and tells `observers`. A squad that fails or an observer that
/// objects ends the run, and the summary says so; it also says which observers have failed.
pub fn play(
    scenario: &Scenario,
    arena: &mut Arena,
    squad: &mut dyn Squad,
    plan: Plan,
    observers: &mut [&mut dyn Observer],
    stop: &StopFlag,
) -> Summary {
    play_under(&Acts::default(), scenario, arena, squad, plan, observers, stop)
}

/// Like [`play`], under the hands of whoever asks for `acts`.
pub fn play_under(
    acts: &Acts,
    scenario: &Scenario,
    arena: &mut Arena,
    squad: &mut dyn Squad,
    plan: Plan,
    observers: &mut [&mut dyn Observer],
    stop: &StopFlag,
) -> Summary {
    let robots = arena.poses().len();
    let mut run = Run {
        acts,
        acted: Vec::new(),
        hold: Hold::default(),
        scenario: Cow::Borrowed(scenario),
        arena,
        squad,
        plan,
        answers: vec![None; robots],
        observers: Observers::new(observers),
        stop,
        stamps: None,
        incidents: Vec::new(),
        told: 0,
        converged_at_s: None,
        cores: if plan.shares { Cores::for_robots(scenario.robot_count()) } else { Cores::One },
        lag: None,
        // Three digits from a nanosecond to an hour.
        tick_ns: Histogram::new_with_bounds(1, 3_600_000_000_000, 3).expect("the bounds are valid"),
    };
    let began = Instant::now();
    let joined = run.join_all();
    let start_up = began.elapsed();
    let started = Instant::now();
    let course = joined.and_then(|()| run.follow());
    let wall = started.elapsed();
    acts.close();
    let (ended, failure) = match course {
        Ok(ending) => (ending, None),
        Err(Interruption(why)) => (Ending::Failed, Some(why)),
    };
    run.finish(ended, failure, start_up, wall)
}

struct Run<'a, 'o> {
    acts: &'a Acts,
    /// Acts so far.
    acted: Vec<ActLine>,
    hold: Hold,
    /// With what acts have made of its fault plan.
    scenario: Cow<'a, Scenario>,
    arena: &'a mut Arena,
    squad: &'a mut dyn Squad,
    plan: Plan,
    answers: Vec<Option<Answer>>,
    observers: Observers<'a, 'o>,
    stop: &'a StopFlag,
    /// Moments of the present tick, if agents are measured.
    stamps: Option<TickStamps>,
    /// Incidents so far, and how many of them observers know.
    incidents: Vec<Incident>,
    told: usize,
    converged_at_s: Option<f64>,
    cores: Cores,
    /// In real time, how it went with the wall clock.
    lag: Option<Lag>,
    tick_ns: Histogram<u64>,
}

/// Longest nap, so that acts and a wish to stop are heard.
const NAP: Duration = Duration::from_millis(20);
/// Time between two warnings that the machine does not keep up.
const LATE_AGAIN: Duration = Duration::from_secs(5);

/// Reason why a run is cut short.
struct Interruption(String);

impl From<SquadError> for Interruption {
    fn from(error: SquadError) -> Self {
        Self(error.0)
    }
}

impl Run<'_, '_> {
    fn join_all(&mut self) -> Result<(), Interruption> {
        let Self { squad, answers, observers, stop, .. } = self;
        squad.join_all(answers, stop, &mut |waiting| {
            observers.each(|observer| observer.waiting(waiting.as_ref()));
        })?;
        let info = RunInfo {
            scenario: &self.scenario,
            engine: self.plan.engine,
            mode: self.plan.mode,
            speed: self.plan.factor(),
        };
        self.observers.try_each(|observer| observer.started(&info));
        Ok(())
    }

    fn follow(&mut self) -> Result<Ending, Interruption> {
        let Plan { mode, overload, .. } = self.plan;
        let mut pace = Pace::new(self.plan.factor(), overload, Moment::now());
        let mut stood = Standstills::begin();
        let mut told = None;
        while !self.stop.is_raised() {
            self.obey(&mut pace);
            if self.hold.holds() {
                self.nap(NAP)?;
                // Ticks that were held back are not late.
                pace.begin_anew(Moment::now());
                continue;
            }
            let took = self.tick()?;
            self.hold.passed();
            let ending = self.look(took)?;
            if let Some(ending) = ending {
                return Ok(ending);
            }
            if let Some(time) = stood.news() {
                pace.stood_still(time);
                if mode == Mode::Realtime {
                    let seconds = time.as_secs_f64();
                    tracing::warn!("the run stood still for {seconds:.1} s, which are lost");
                }
            }
            let Some(next) = pace.next(self.scenario.step_s.get(), Moment::now()) else { continue };
            self.lag = (mode == Mode::Realtime).then(|| pace.lag());
            if let Some(late) = next.late.filter(|_| mode == Mode::Realtime) {
                self.say_late(&pace, late, &mut told)?;
            }
            self.wait(next.due, &mut pace)?;
        }
        Ok(Ending::Interrupted)
    }

    /// Does what was asked for. Returns whether ticks are to pass at other times than before.
    fn obey(&mut self, pace: &mut Pace) -> bool {
        let mut is_paced_anew = false;
        for Asked { act, reply } in self.acts.take() {
            is_paced_anew |= matches!(act, Act::Pause | Act::Step { .. } | Act::Speed { .. });
            // Whoever asked may have gone.
            let _ = reply.send(self.act(act, pace));
        }
        is_paced_anew
    }

    fn act(&mut self, act: Act, pace: &mut Pace) -> Result<Done, Refused> {
        let tick = self.arena.next_tick();
        let mut done = Done { tick, ..Done::default() };
        let (what, changed) = match act {
            Act::Save => {
                done.scenario = Some(self.scenario.to_toml());
                return Ok(done);
            }
            Act::Pause | Act::Resume | Act::Step { .. } | Act::Speed { .. }
                if self.plan.mode == Mode::Realtime =>
            {
                return Err(
                    "robots in real time have clocks of their own, which cannot be held or hurried".into()
                );
            }
            Act::Pause => {
                self.hold.pause();
                ("ticks are held".into(), None)
            }
            Act::Resume => {
                self.hold.resume();
                ("ticks pass again".into(), None)
            }
            Act::Step { ticks: 0 } => return Err("a step is of 1 tick or more".into()),
            Act::Step { ticks } => {
                self.hold.step(ticks);
                (format!("ticks pass up to {}, and are held then", tick.saturating_add(ticks - 1)), None)
            }
            Act::Speed { factor: Some(factor) } if !(factor > 0.0 && factor.is_finite()) => {
                return Err(format!(
                    "{factor} is no speed: give virtual seconds per real second, more than 0"
                ));
            }
            Act::Speed { factor } => {
                pace.set_factor(factor, Moment::now());
                let what = match factor {
                    Some(factor) => format!("ticks pass at {factor} times real time"),
                    None => "ticks pass as fast as they can".into(),
                };
                (what, None)
            }
            Act::Begin { fault } => {
                let scenario = self.scenario.with_fault(&fault, tick).map_err(|error| error.to_string())?;
                let index = scenario.fault.len() - 1;
                done.fault = Some(index);
                (format!("fault {index} ({}) is added", scenario.fault[index].name()), Some(scenario))
            }
            Act::End { fault } => {
                let scenario =
                    self.scenario.with_fault_ended(fault, tick).map_err(|error| error.to_string())?;
                done.fault = Some(fault);
                (format!("fault {fault} ({}) is ended", scenario.fault[fault].name()), Some(scenario))
            }
        };
        if let Some(scenario) = &changed {
            self.arena.change_plan(scenario);
        }
        tracing::info!("tick {tick}: {what}");
        let (is_held, speed) = (self.hold.is_held(), pace.factor());
        let acted = Acted { tick, what: &what, scenario: changed.as_ref(), is_held, speed };
        self.observers.each(|observer| observer.acted(&acted));
        self.acted.push(ActLine { tick, what });
        if let Some(scenario) = changed {
            self.scenario = Cow::Owned(scenario);
        }
        Ok(done)
    }

    /// One tick. Returns how long it took.
    fn tick(&mut self) -> Result<Duration, Interruption> {
        let began = Instant::now();
        let Self { arena, squad, answers, observers, .. } = self;
        let tick = arena.next_tick();
        arena.note_losses(observers.want_losses());
        self.stamps = squad.now_ns().map(|began_ns| TickStamps { began_ns, ..TickStamps::default() });
        let mut stamp = |squad: &dyn Squad, note: fn(&mut TickStamps) -> &mut Option<u64>| {
            if let Some(stamps) = &mut self.stamps {
                *note(stamps) = squad.now_ns();
            }
        };
        let process_faults = arena.process_faults(&squad.left_out());
        observers.each(|observer| observer.tick_begins(tick, &process_faults));
        let waiting = &mut |waiting: Option<squad::Waiting>| {
            observers.each(|observer| observer.waiting(waiting.as_ref()));
        };
        squad.apply_process_faults(tick, &process_faults, answers, waiting)?;
        if let Some(percepts) = arena.tick_by(&self.cores, answers) {
            stamp(*squad, |stamps| &mut stamps.ready_ns);
            squad.send(percepts)?;
            stamp(*squad, |stamps| &mut stamps.sent_ns);
            squad.collect(answers, waiting)?;
            stamp(*squad, |stamps| &mut stamps.answered_ns);
        }
        let took = began.elapsed();
        self.tick_ns.saturating_record(took.as_nanos() as u64);
        Ok(took)
    }

    /// Tells the observers of the tick that has passed. Returns how the run ends, if it ends with it.
    fn look(&mut self, took: Duration) -> Result<Option<Ending>, Interruption> {
        let errors = EstimatedErrors::of(&self.answers);
        let ending = self.ending(&errors);
        self.pass_on();
        let view = view(&self.scenario, self.arena, self.squad, &self.answers, self.stamps, errors);
        let view = TickView { took, is_last: ending.is_some(), ..view };
        self.observers.try_each(|observer| observer.ticked(&view));
        match self.observers.objection() {
            Some(what) => Err(Interruption(what)),
            None => Ok(ending),
        }
    }

    /// Tells observers of incidents and cycles that have become known.
    fn pass_on(&mut self) {
        let mut cycles = Vec::new();
        self.squad.take_incidents(&mut self.incidents);
        self.squad.take_cycles(&mut cycles);
        self.observers.pass_on(&self.incidents[self.told..], &cycles);
        self.told = self.incidents.len();
        if let Some(stamps) = &mut self.stamps {
            stamps.ended_ns = self.squad.now_ns().unwrap_or(stamps.ended_ns);
        }
    }

    /// The machine does not keep up: says so, again after a while, or gives up.
    fn say_late(&self, pace: &Pace, late: Duration, told: &mut Option<Instant>) -> Result<(), Interruption> {
        let (tick, seconds) = (self.arena.next_tick(), late.as_secs_f64());
        let what = format!("this machine does not keep up: tick {tick} is {seconds:.3} s late");
        if pace.overload() == Overload::Fail {
            let hint = "take fewer robots or a longer step, or --overload report";
            return Err(Interruption(format!("{what} ({hint})")));
        }
        if told.is_none_or(|told| told.elapsed() > LATE_AGAIN) {
            *told = Some(Instant::now());
            let Lag { late_ticks, ticks, lost_s, .. } = pace.lag();
            tracing::warn!("{what} ({late_ticks} of {ticks} ticks so far, {lost_s:.1} s lost for good)");
        }
        Ok(())
    }

    /// Waits until `due`, or for the wish to stop, or to let ticks pass at other times.
    fn wait(&mut self, due: Moment, pace: &mut Pace) -> Result<(), Interruption> {
        while !self.stop.is_raised() && !self.obey(pace) {
            let left = due.since(Moment::now());
            if left.is_zero() {
                break;
            }
            self.nap(left.min(NAP))?;
        }
        Ok(())
    }

    /// Waits, and takes in what comes meanwhile.
    fn nap(&mut self, time: Duration) -> Result<(), Interruption> {
        let Self { squad, observers, .. } = self;
        squad.poll_until(Instant::now() + time, &mut |waiting| {
            observers.each(|observer| observer.waiting(waiting.as_ref()));
        })?;
        Ok(())
    }

    /// Notes convergence; says how the run ends if it ends with this tick.
    fn ending(&mut self, errors: &EstimatedErrors) -> Option<Ending> {
        if self.converged_at_s.is_none() && self.is_converged(errors) {
            self.converged_at_s = Some(self.arena.time_s());
        }
        match self.converged_at_s {
            Some(_) if self.scenario.convergence.stop => Some(Ending::Converged),
            _ if self.arena.current_tick() == self.scenario.ticks() => Some(Ending::Finished),
            _ => None,
        }
    }

    /// Whether the mean ‖ê‖ is below the tolerance, and is that of every robot that takes part. In real time some may
    /// be silent: of them nothing is known.
    fn is_converged(&self, errors: &EstimatedErrors) -> bool {
        let is_close = |mean_m| mean_m < self.scenario.convergence.tolerance_m.get();
        let takes_part = |robot: &&RobotStatus| robot.is_alive() && !robot.is_paused();
        errors.are_of_everyone()
            && errors.mean_m.is_some_and(is_close)
            && self.squad.robot_statuses().iter().filter(takes_part).count()
                == self.answers.iter().flatten().count()
    }

    /// Dismisses the agents and has the summary completed by those who know something.
    fn finish(
        mut self,
        ended: Ending,
        failure: Option<String>,
        start_up: Duration,
        wall: Duration,
    ) -> Summary {
        self.pass_on();
        self.squad.dismiss();
        self.pass_on();
        let stated = self.squad.take_properties();
        let properties = Properties::of(&stated);
        let mut summary = Summary { properties, ..self.summary(ended, failure, start_up, wall) };
        let Self { scenario, arena, squad, answers, stamps, mut observers, .. } = self;
        let view = TickView {
            is_last: true,
            metrics: OnceCell::from(summary.end),
            ..view(&scenario, arena, squad, &answers, stamps, EstimatedErrors::of(&answers))
        };
        observers.try_each(|observer| observer.summarize(&view, &mut summary));
        summary.unwritten.extend(observers.failures());
        observers.try_each(|observer| observer.finished(&view, &summary));
        summary.unwritten.extend(observers.failures());
        summary
    }

    fn summary(&self, ended: Ending, failure: Option<String>, start_up: Duration, wall: Duration) -> Summary {
        let (virtual_time_s, wall_time_s) = (self.arena.time_s(), wall.as_secs_f64());
        Summary {
            scenario: self.scenario.name.clone(),
            seed: self.scenario.seed.get(),
            robots: self.scenario.robot_count(),
            engine: self.plan.engine.into(),
            mode: self.plan.mode,
            ended,
            failure,
            ticks: self.arena.current_tick(),
            virtual_time_s,
            wall_time_s,
            start_up_s: start_up.as_secs_f64(),
            real_time_factor: (wall_time_s > 0.0).then(|| virtual_time_s / wall_time_s),
            digest: self.arena.digest(),
            converged_at_s: self.converged_at_s,
            end: self.arena.metrics(&self.answers, attendance(self.squad)),
            contacts_unsolved: self.arena.contacts_unsolved(),
            contacts_coarse: self.arena.contacts_coarse(),
            commands_refused: self.squad.robot_statuses().iter().map(|robot| robot.refused).sum(),
            delivered: self.arena.crowding().and_then(|crowding| Delivered::of(crowding, &self.scenario)),
            granted: self.scenario.granted(),
            faults: self
                .arena
                .ledger()
                .map(|line| Fault { line: line.clone(), recovered: Recovered::default() })
                .collect(),
            incidents: self.incidents.clone(),
            acts: self.acted.clone(),
            properties: Properties::default(),
            tick_us: TickTimes::of(&self.tick_ns),
            lag: self.lag,
            agents: None,
            unwritten: Vec::new(),
        }
    }
}

/// One tick as observers see it.
fn view<'a>(
    scenario: &'a Scenario,
    arena: &'a Arena,
    squad: &'a dyn Squad,
    answers: &'a [Option<Answer>],
    stamps: Option<TickStamps>,
    errors: EstimatedErrors,
) -> TickView<'a> {
    let (took, is_last, metrics) = (Duration::ZERO, false, OnceCell::new());
    TickView { scenario, arena, squad, answers, errors, took, stamps, is_last, metrics }
}

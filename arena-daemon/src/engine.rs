//! The loop that every engine shares: tick the arena, ask the squad, record.

use std::time::{Duration, Instant};

use arena::{
    Arena,
    metrics::EstimatedErrors,
    recovery::{Recovered, Recovery},
};
use hdrhistogram::Histogram;
use protocol::{command::Answer, setup::Mode};
use scenario::Scenario;

use crate::{
    cores::Cores,
    live::SnapshotPublisher,
    outputs::Outputs,
    pace::{Lag, Overload, Pace},
    profile::Totals,
    progress::{Audience, Progress, Status},
    squad::{Answers, RobotStatus, Squad, SquadError},
    standstill::{Moment, Standstills},
    stop::StopFlag,
    summary::{Delivered, Ending, Fault, Summary, TickTimes},
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
    /// Destination of progress reports.
    pub audience: Audience,
}

/// Looks at the arena and the answers to its percepts after each tick. What it objects to ends the run.
pub type Observer<'a> = dyn FnMut(&Arena, &[Option<Answer>]) -> Result<(), String> + 'a;

/// The observer who objects to nothing.
pub fn no_observer(_: &Arena, _: &[Option<Answer>]) -> Result<(), String> {
    Ok(())
}

/// Runs `scenario`, whose start `arena` is, to its end, watched by `observer`, and writes what it leaves.
/// A squad that fails or an observer that objects ends the run, and the summary says so; it also says what could not
/// be written.
pub fn run(
    scenario: &Scenario,
    arena: &mut Arena,
    squad: &mut dyn Squad,
    plan: Plan,
    outputs: Outputs,
    stop: &StopFlag,
    observer: &mut Observer<'_>,
) -> Summary {
    let robots = arena.poses().len();
    let publisher = SnapshotPublisher::new(squad.live());
    let mut run = Run {
        scenario,
        arena,
        squad,
        answers: vec![None; robots],
        outputs,
        stop,
        publisher,
        converged_at_s: None,
        recovery: Recovery::new(scenario),
        cores: if plan.shares { Cores::for_robots(scenario.robot_count()) } else { Cores::One },
        lag: None,
        // Three digits from a nanosecond to an hour.
        tick_ns: Histogram::new_with_bounds(1, 3_600_000_000_000, 3).expect("the bounds are valid"),
    };
    let began = Instant::now();
    let joined = run.squad.join_all(stop);
    let start_up = began.elapsed();
    let started = Instant::now();
    let course = match joined {
        Ok(answers) => {
            run.answers = answers;
            run.publisher.start();
            run.follow(plan, observer)
        }
        Err(error) => Err(Interruption::Squad(error)),
    };
    let wall = started.elapsed();
    logging::at_no_tick();
    run.publisher.end(&run.status(), run.arena.packets(), run.squad);
    let profile = run.squad.profile();
    run.squad.dismiss();
    let (ended, failure) = match course {
        Ok(ending) => (ending, None),
        Err(Interruption::Squad(error)) => (Ending::Failed, Some(error.to_string())),
        Err(Interruption::Observer(why) | Interruption::Overload(why)) => (Ending::Failed, Some(why)),
    };
    let agents = profile.as_ref().map(Totals::of);
    let mut summary = Summary { agents, ..run.summary(plan, ended, failure, start_up, wall) };
    let robot_statuses = run.squad.robot_statuses();
    run.outputs.finish(&mut summary, run.arena, &robot_statuses, &run.answers, profile.as_ref());
    summary
}

struct Run<'a> {
    scenario: &'a Scenario,
    arena: &'a mut Arena,
    squad: &'a mut dyn Squad,
    answers: Answers,
    outputs: Outputs,
    stop: &'a StopFlag,
    publisher: SnapshotPublisher,
    converged_at_s: Option<f64>,
    recovery: Recovery,
    cores: Cores,
    /// In real time, how it went with the wall clock.
    lag: Option<Lag>,
    tick_ns: Histogram<u64>,
}

/// Longest nap, so that a wish to stop is heard.
const NAP: Duration = Duration::from_millis(100);
/// Time between two warnings that the machine does not keep up.
const LATE_AGAIN: Duration = Duration::from_secs(5);

/// Reason why a run is cut short.
enum Interruption {
    Overload(String),
    Squad(SquadError),
    Observer(String),
}

impl Run<'_> {
    fn follow(&mut self, plan: Plan, observer: &mut Observer<'_>) -> Result<Ending, Interruption> {
        let factor = plan.speed.or((plan.mode == Mode::Realtime).then_some(1.0));
        let mut pace = Pace::new(factor, plan.overload, Moment::now());
        let mut stood = Standstills::begin();
        let mut told = None;
        let mut progress = Progress::begin(self.scenario.ticks(), plan.audience);
        while !self.stop.is_raised() {
            self.tick().map_err(Interruption::Squad)?;
            observer(self.arena, &self.answers).map_err(Interruption::Observer)?;
            let status = self.status();
            let ending = self.ending(&status);
            self.record(&status, ending.is_some());
            if let Some(ending) = ending {
                return Ok(ending);
            }
            progress.show(&status);
            self.publisher.tell(&status, || self.arena.packets(), self.squad);
            if let Some(time) = stood.news() {
                pace.stood_still(time);
                if plan.mode == Mode::Realtime {
                    let seconds = time.as_secs_f64();
                    tracing::warn!("the run stood still for {seconds:.1} s, which are lost");
                }
            }
            let Some(next) = pace.next(self.scenario.step_s.get(), Moment::now()) else { continue };
            self.lag = (plan.mode == Mode::Realtime).then(|| pace.lag());
            if let Some(late) = next.late.filter(|_| plan.mode == Mode::Realtime) {
                self.say_late(&pace, late, &mut told)?;
            }
            self.wait(next.due).map_err(Interruption::Squad)?;
        }
        Ok(Ending::Interrupted)
    }

    /// The machine does not keep up: says so, again after a while, or gives up.
    fn say_late(&self, pace: &Pace, late: Duration, told: &mut Option<Instant>) -> Result<(), Interruption> {
        let (tick, seconds) = (self.arena.next_tick(), late.as_secs_f64());
        let what = format!("this machine does not keep up: tick {tick} is {seconds:.3} s late");
        if pace.overload() == Overload::Fail {
            let hint = "take fewer robots or a longer step, or --overload report";
            return Err(Interruption::Overload(format!("{what} ({hint})")));
        }
        if told.is_none_or(|told| told.elapsed() > LATE_AGAIN) {
            *told = Some(Instant::now());
            let Lag { late_ticks, ticks, lost_s, .. } = pace.lag();
            tracing::warn!("{what} ({late_ticks} of {ticks} ticks so far, {lost_s:.1} s lost for good)");
        }
        Ok(())
    }

    /// Waits until `due`, or for the wish to stop.
    fn wait(&mut self, due: Moment) -> Result<(), SquadError> {
        while !self.stop.is_raised() {
            let left = due.since(Moment::now());
            if left.is_zero() {
                break;
            }
            self.squad.poll_until(Instant::now() + left.min(NAP))?;
        }
        Ok(())
    }

    fn record(&mut self, status: &Status, is_last: bool) {
        let due = |every: u64| is_last || status.tick.is_multiple_of(every);
        if self.outputs.are_kept() && due(self.scenario.sample_every_ticks()) {
            self.outputs.sample(status, &self.arena.metrics(&self.answers));
        }
        if self.scenario.poses_every_ticks().is_some_and(due) {
            self.outputs.poses(status, self.arena, &self.answers);
        }
    }

    fn tick(&mut self) -> Result<(), SquadError> {
        let began = Instant::now();
        logging::at_tick(self.arena.next_tick());
        let process_faults = self.arena.process_faults(&self.squad.left_out());
        self.squad.apply_process_faults(self.arena.next_tick(), &process_faults, &mut self.answers)?;
        if let Some(percepts) = self.arena.tick_by(&self.cores, &self.answers) {
            self.squad.exchange(percepts, &mut self.answers)?;
        }
        let took = began.elapsed();
        self.tick_ns.saturating_record(took.as_nanos() as u64);
        self.publisher.ticked(took);
        let tick = self.arena.current_tick();
        if self.recovery.wants(tick) && self.scenario.begins_cycle(tick) {
            self.recovery.observe(tick, self.arena.disturbance(&self.answers));
        }
        Ok(())
    }

    fn status(&self) -> Status {
        Status {
            tick: self.arena.current_tick(),
            ticks: self.scenario.ticks(),
            time_s: self.arena.time_s(),
            errors: EstimatedErrors::of(&self.answers),
            present: self.answers.iter().flatten().count(),
        }
    }

    /// Notes convergence; says how the run ends if it ends with this tick.
    fn ending(&mut self, status: &Status) -> Option<Ending> {
        if self.converged_at_s.is_none() && self.is_converged(status) {
            self.converged_at_s = Some(status.time_s);
        }
        match self.converged_at_s {
            Some(_) if self.scenario.convergence.stop => Some(Ending::Converged),
            _ if status.tick == status.ticks => Some(Ending::Finished),
            _ => None,
        }
    }

    /// Whether the mean ‖ê‖ is below the tolerance, and is that of every robot that takes part. In real time some may
    /// be silent: of them nothing is known.
    fn is_converged(&self, status: &Status) -> bool {
        let is_close = |mean_m| mean_m < self.scenario.convergence.tolerance_m.get();
        let takes_part = |standing: &RobotStatus| standing.alive && !standing.paused;
        status.errors.are_of_everyone()
            && status.errors.mean_m.is_some_and(is_close)
            && self.squad.robot_statuses().iter().filter(|standing| takes_part(standing)).count()
                == status.present
    }

    fn faults(&self) -> Vec<Fault> {
        let lines = self.arena.ledger().cloned().zip(self.recovery.recovered());
        lines
            .map(|(line, recovered)| {
                // Nobody recovers from what never was.
                let recovered = if line.fired_tick.is_some() { recovered } else { Recovered::default() };
                Fault { line, recovered }
            })
            .collect()
    }

    fn summary(
        &self,
        plan: Plan,
        ended: Ending,
        failure: Option<String>,
        start_up: Duration,
        wall: Duration,
    ) -> Summary {
        let (virtual_time_s, wall_time_s) = (self.arena.time_s(), wall.as_secs_f64());
        Summary {
            scenario: self.scenario.name.clone(),
            seed: self.scenario.seed.get(),
            robots: self.scenario.robot_count(),
            granted: self.scenario.granted(),
            engine: plan.engine.into(),
            mode: plan.mode,
            ended,
            failure,
            ticks: self.arena.current_tick(),
            virtual_time_s,
            wall_time_s,
            start_up_s: start_up.as_secs_f64(),
            real_time_factor: (wall_time_s > 0.0).then(|| virtual_time_s / wall_time_s),
            digest: self.arena.digest(),
            converged_at_s: self.converged_at_s,
            end: self.arena.metrics(&self.answers),
            contacts_unsolved: self.arena.contacts_unsolved(),
            contacts_coarse: self.arena.contacts_coarse(),
            commands_refused: self.squad.robot_statuses().iter().map(|standing| standing.refused).sum(),
            delivered: self.arena.crowding().and_then(|crowding| Delivered::of(crowding, self.scenario)),
            faults: self.faults(),
            incidents: self.squad.incidents().to_vec(),
            tick_us: TickTimes::of(&self.tick_ns),
            lag: self.lag,
            agents: None,
            unwritten: Vec::new(),
        }
    }
}

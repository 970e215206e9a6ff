//! Workers that play the trials of a batch: threads, each with all controllers of a trial; or processes, the same
//! ones from trial to trial. Either hands over what is done in the order of the plan.

use std::{
    collections::BTreeMap,
    mem,
    num::NonZeroUsize,
    sync::{
        atomic::{AtomicUsize, Ordering},
        mpsc,
    },
    thread,
};

use anyhow::{Context, anyhow};
use coverage::law::Law;
use engine::{StopFlag, summary::Ending};
use observe::trial::Record;
use options::Work;
use processes::signals::raise_on_stop;
use protocol::setup::Mode;
use scenario::{Controller, PayloadBytes, ProcessesSpec, RobotSet, Scenario};
use transport::run_dir::RunDir;

use super::{
    folder::{Done, Played},
    options::BatchArgs,
    plan::{Plan, Trial},
};
use crate::{
    failure::Failure,
    in_process, limits, name,
    outcome::Outcome,
    run::Engine,
    supervisor::{self, Watch},
};

/// Takes what one trial came to, in the order of the plan.
pub(super) type Keeper<'a> = dyn FnMut(usize, Done) -> anyhow::Result<()> + 'a;

/// Workers of a batch.
#[derive(Clone, Copy, Debug)]
pub(super) enum Workers {
    Threads(usize),
    Processes,
}

impl Workers {
    /// # Errors
    /// If the operating system does not allow that many processes.
    pub(super) fn new(args: &BatchArgs, plan: &Plan) -> Result<Self, Failure> {
        match args.engine {
            Engine::InProcess => {
                let cores = thread::available_parallelism().map_or(1, NonZeroUsize::get);
                Ok(Self::Threads(args.jobs.map_or(cores, usize::from)))
            }
            Engine::Processes if args.jobs.is_some() => {
                Err(Failure::Usage(anyhow!("--jobs is about trials in process; use --engine in-process")))
            }
            Engine::Processes => {
                for setting in &plan.settings {
                    let scenario = &setting.scenario;
                    limits::prepare(scenario.robot_count(), scenario.plane(Mode::Lockstep))
                        .map_err(Failure::Usage)?;
                }
                Ok(Self::Processes)
            }
        }
    }

    /// Plays the trials of `plan` that are `missing`, in their order. Returns the signal that has cut it short, if one
    /// has.
    ///
    /// # Errors
    /// The first trial that fails, after those before it have been kept; or what `keep` fails with.
    pub(super) fn play(
        self,
        plan: &Plan,
        missing: &[usize],
        keep: &mut Keeper<'_>,
    ) -> anyhow::Result<Option<i32>> {
        match self {
            Self::Threads(threads) => by_threads(plan, missing, threads, keep),
            Self::Processes => by_processes(plan, missing, keep),
        }
    }
}

fn by_threads(
    plan: &Plan,
    missing: &[usize],
    threads: usize,
    keep: &mut Keeper<'_>,
) -> anyhow::Result<Option<i32>> {
    let stop = StopFlag::default();
    raise_on_stop(&stop).context("cannot listen for signals")?;
    let (next, over) = (AtomicUsize::new(0), StopFlag::default());
    let (sender, played) = mpsc::channel();
    let outcome = thread::scope(|scope| {
        for _ in 0..threads {
            let (sender, next, stop, over) = (sender.clone(), &next, &stop, &over);
            scope.spawn(move || {
                while !stop.is_raised() && !over.is_raised() {
                    let at = next.fetch_add(1, Ordering::Relaxed);
                    let Some(&index) = missing.get(at) else { break };
                    if sender.send((index, played_in_process(plan, index, stop))).is_err() {
                        break;
                    }
                }
            });
        }
        drop(sender);
        let outcome = in_order(missing, &played, keep);
        // Whoever is still at work need not begin another trial.
        over.raise(1);
        outcome
    });
    match stop.signal() {
        Some(signal) => Ok(Some(signal)),
        None => outcome.map(|()| None),
    }
}

/// Hands over what comes in any order, in order.
fn in_order(
    missing: &[usize],
    played: &mpsc::Receiver<(usize, anyhow::Result<Done>)>,
    keep: &mut Keeper<'_>,
) -> anyhow::Result<()> {
    let (mut at, mut waiting) = (0, BTreeMap::new());
    for (index, outcome) in played {
        waiting.insert(index, outcome);
        while let Some(&next) = missing.get(at)
            && let Some(outcome) = waiting.remove(&next)
        {
            keep(next, outcome?)?;
            at += 1;
        }
    }
    Ok(())
}

fn played_in_process(plan: &Plan, index: usize, stop: &StopFlag) -> anyhow::Result<Done> {
    let trial = plan.trial(index);
    let record =
        in_process::trial(&trial.scenario, stop).and_then(whole).with_context(|| named(plan, &trial))?;
    match record.incidents.first() {
        None => done(plan, &trial, record, stop),
        Some(incident) => {
            // No accident: it would end the same again.
            let named = named(plan, &trial);
            tracing::warn!("{named} lost agents: {}; it is left out of the statistics", incident.what);
            Ok(Done::LostAgents)
        }
    }
}

/// Returns what is kept of a trial, with the exact controller's cost if it is asked for.
fn done(plan: &Plan, trial: &Trial<'_>, record: Record, stop: &StopFlag) -> anyhow::Result<Done> {
    let exact_cost_h = match plan.identity.exact {
        false => None,
        true => {
            let mut scenario = trial.scenario.clone();
            for law in scenario.controllers.iter_mut().filter_map(Controller::law_mut) {
                law.law = Law::Exact;
            }
            let exact = in_process::trial(&scenario, stop).and_then(whole);
            exact.with_context(|| format!("{} with the exact controller", named(plan, trial)))?.end.cost_h
        }
    };
    Ok(Done::Played(Box::new(Played { record, exact_cost_h })))
}

/// Only a trial that went to its end counts.
fn whole(record: Record) -> anyhow::Result<Record> {
    match record.ended {
        Ending::Finished | Ending::Converged => Ok(record),
        Ending::Interrupted => Err(anyhow!("interrupted")),
        Ending::Failed => Err(anyhow!("{}", record.failure.unwrap_or_else(|| "it failed".into()))),
    }
}

/// Name of a trial of `plan` in messages, with the values of its setting.
pub(super) fn named(plan: &Plan, trial: &Trial<'_>) -> String {
    let Trial { setting, trial: number, of, scenario } = trial;
    let swept =
        plan.identity.sweeps.iter().zip(&of.values).map(|(sweep, value)| format!("; {}={value}", sweep.key));
    format!("trial {number} of setting {setting} (seed {}{})", scenario.seed, swept.collect::<String>())
}

/// Swarm after swarm; each plays trials as long as it is whole and they have as many robots as it.
fn by_processes(plan: &Plan, missing: &[usize], keep: &mut Keeper<'_>) -> anyhow::Result<Option<i32>> {
    let watch = Watch::begin()?;
    let mut course = Course { plan, missing, is_second_time: false };
    while !course.missing.is_empty() {
        if let Some(signal) = one_swarm(&mut course, &watch, keep)? {
            return Ok(Some(signal));
        }
    }
    Ok(None)
}

/// How far the trials have been played by processes. These may be lost without having been meant to be: killed by hand,
/// or by the system where memory is short. Then a trial is not the one that was asked for, and a new swarm plays it
/// again, once.
#[derive(Debug)]
struct Course<'a> {
    plan: &'a Plan,
    /// Trials still to be played.
    missing: &'a [usize],
    /// Whether the first of them has been played before.
    is_second_time: bool,
}

impl<'a> Course<'a> {
    /// The trial that is played now, while there is one.
    fn present(&self) -> Option<Trial<'a>> {
        self.missing.first().map(|&index| self.plan.trial(index))
    }

    /// Takes what the present trial came to. Returns whether the same swarm can go on.
    fn take(&mut self, record: Record, keep: &mut Keeper<'_>) -> anyhow::Result<bool> {
        let Some(&index) = self.missing.first() else { return Ok(false) };
        if record.ended == Ending::Interrupted {
            return Ok(false);
        }
        let trial = self.plan.trial(index);
        let lost = record.incidents.first().map(|incident| incident.what.clone());
        match (record.failure.clone(), lost) {
            (None, None) => {
                let goes_on = record.squad_is_whole;
                let done = done(self.plan, &trial, whole(record)?, &StopFlag::default())?;
                self.keep_as(index, done, keep)?;
                Ok(goes_on)
            }
            (None, Some(what)) if self.is_second_time => {
                tracing::warn!(
                    "{} lost agents again: {what}; it is left out of the statistics",
                    named(self.plan, &trial)
                );
                self.keep_as(index, Done::LostAgents, keep)?;
                Ok(false)
            }
            (Some(what), _) | (None, Some(what)) => {
                self.once_more(anyhow!(what))?;
                Ok(false)
            }
        }
    }

    fn keep_as(&mut self, index: usize, done: Done, keep: &mut Keeper<'_>) -> anyhow::Result<()> {
        keep(index, done)?;
        self.missing = &self.missing[1..];
        self.is_second_time = false;
        Ok(())
    }

    /// The present trial was lost: it is played again, unless it has been already.
    fn once_more(&mut self, why: anyhow::Error) -> anyhow::Result<()> {
        let named = self.present().map_or_else(String::new, |trial| named(self.plan, &trial));
        if mem::replace(&mut self.is_second_time, true) {
            return Err(why.context(named));
        }
        tracing::warn!("{named} is played again by a new swarm: {why:#}");
        Ok(())
    }
}

/// Plays trials by one swarm of processes, until there are no more for it, or it has lost somebody. Returns the signal
/// that has cut it short, if one has.
fn one_swarm(course: &mut Course<'_>, watch: &Watch, keep: &mut Keeper<'_>) -> anyhow::Result<Option<i32>> {
    let Some(Trial { scenario, .. }) = course.present() else { return Ok(None) };
    let swarm = Swarm::of(&scenario);
    let (run, owner) = RunDir::create(name::unique(&name::plain(&scenario.name)))?;
    let before = (course.missing.len(), course.is_second_time);
    // What ends the batch, in contrast to what ends the swarm.
    let mut failed = None;
    let next_trial = Box::new(|record: Record| {
        let goes_on = course.take(record, keep).unwrap_or_else(|error| {
            failed = Some(error);
            false
        });
        let following = course.present().filter(|_| goes_on).map(|trial| trial.scenario);
        Ok(following.filter(|scenario| Swarm::of(scenario) == swarm).map(|scenario| scenario.to_toml()))
    });
    let outcome = supervisor::run(Work::Trials, &run, &scenario, watch, Some(next_trial));
    run.remove_own(owner)?;
    let nothing_came = before == (course.missing.len(), course.is_second_time);
    match (failed, outcome) {
        (Some(error), _) => Err(error),
        (None, Ok(Outcome { signal: Some(signal), .. })) => Ok(Some(signal)),
        (None, Ok(_)) if nothing_came => {
            course.once_more(anyhow!("the arena ended without a result")).map(|()| None)
        }
        (None, Ok(_)) => Ok(None),
        (None, Err(error)) => course.once_more(error).map(|()| None),
    }
}

/// Settings that a swarm is opened with once, and keeps: trials must agree on them that one swarm plays.
#[derive(PartialEq)]
struct Swarm {
    /// Robots by the programs that are their agents.
    agents: Vec<(RobotSet, Vec<String>)>,
    processes: ProcessesSpec,
    payload_bytes_max: PayloadBytes,
}

impl Swarm {
    fn of(scenario: &Scenario) -> Self {
        let agent = |it: &Controller| (it.robots.clone(), it.agent_words());
        Self {
            agents: scenario.controllers.iter().map(agent).collect(),
            processes: scenario.processes.clone(),
            payload_bytes_max: scenario.channel.payload_bytes_max,
        }
    }
}

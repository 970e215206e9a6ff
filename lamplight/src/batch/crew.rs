//! Who plays the trials of a batch: threads, each with all controllers of a trial; or processes, the same ones
//! from trial to trial. Either hands over what is done in the order of the plan.

use std::{
    collections::BTreeMap,
    fs,
    num::NonZeroUsize,
    sync::{
        atomic::{AtomicUsize, Ordering},
        mpsc,
    },
    thread,
};

use anyhow::{Context, anyhow};
use arena::scenario::Scenario;
use arena_daemon::{
    options::{ModeName, RunOptions, ScenarioOptions},
    pace::Overload,
    stop::StopFlag,
    summary::Ending,
    trace::TraceOptions,
    trial::Record,
};
use protocol::{
    run_dir::RunDir,
    setup::{Law, Mode},
};

use super::{
    BatchArgs,
    folder::Done,
    plan::{Plan, Trial},
};
use crate::{
    failure::Failure,
    in_process, limits, name,
    run::Engine,
    supervisor::{self, Watch},
};

/// Takes what one trial came to, in the order of the plan.
pub(super) type Keeper<'a> = dyn FnMut(usize, Done) -> anyhow::Result<()> + 'a;

/// Those who play.
#[derive(Clone, Copy, Debug)]
pub(super) enum Crew {
    Threads(usize),
    Processes,
}

impl Crew {
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

    /// Plays the trials of `plan` from number `from` on. Returns the signal that has cut it short, if one has.
    ///
    /// # Errors
    /// The first trial that fails, after those before it have been kept; or what `keep` fails with.
    pub(super) fn play(self, plan: &Plan, from: usize, keep: &mut Keeper<'_>) -> anyhow::Result<Option<i32>> {
        match self {
            Self::Threads(threads) => by_threads(plan, from, threads, keep),
            Self::Processes => by_processes(plan, from, keep),
        }
    }
}

fn by_threads(
    plan: &Plan,
    from: usize,
    threads: usize,
    keep: &mut Keeper<'_>,
) -> anyhow::Result<Option<i32>> {
    let stop = StopFlag::default();
    stop.on_signals().context("cannot listen for signals")?;
    let (next, over) = (AtomicUsize::new(from), StopFlag::default());
    let (sender, played) = mpsc::channel();
    let outcome = thread::scope(|scope| {
        for _ in 0..threads {
            let (sender, next, stop, over) = (sender.clone(), &next, &stop, &over);
            scope.spawn(move || {
                while !stop.is_raised() && !over.is_raised() {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    if index >= plan.len()
                        || sender.send((index, played_in_process(plan, index, stop))).is_err()
                    {
                        break;
                    }
                }
            });
        }
        drop(sender);
        let outcome = in_order(from, &played, keep);
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
    from: usize,
    played: &mpsc::Receiver<(usize, anyhow::Result<Done>)>,
    keep: &mut Keeper<'_>,
) -> anyhow::Result<()> {
    let (mut next, mut waiting) = (from, BTreeMap::new());
    for (index, outcome) in played {
        waiting.insert(index, outcome);
        while let Some(outcome) = waiting.remove(&next) {
            keep(next, outcome?)?;
            next += 1;
        }
    }
    Ok(())
}

fn played_in_process(plan: &Plan, index: usize, stop: &StopFlag) -> anyhow::Result<Done> {
    let trial = plan.trial(index);
    let record = in_process::trial(&trial.scenario, stop).and_then(whole).with_context(|| named(&trial))?;
    done(plan, &trial, record, stop)
}

/// What is kept of a trial, with the exact controller's cost if it is asked for.
fn done(plan: &Plan, trial: &Trial<'_>, record: Record, stop: &StopFlag) -> anyhow::Result<Done> {
    let exact_cost_h = match plan.identity.exact {
        false => None,
        true => {
            let mut scenario = trial.scenario.clone();
            scenario.controller.law = Law::Exact;
            let exact = in_process::trial(&scenario, stop).and_then(whole);
            Some(exact.with_context(|| format!("{} with the exact controller", named(trial)))?.end.cost_h)
        }
    };
    Ok(Done { record, exact_cost_h })
}

/// Only a trial that went to its end counts.
fn whole(record: Record) -> anyhow::Result<Record> {
    match record.ended {
        Ending::Finished | Ending::Converged => Ok(record),
        Ending::Interrupted => Err(anyhow!("interrupted")),
        Ending::Failed => Err(anyhow!("{}", record.failure.unwrap_or_else(|| "it failed".into()))),
    }
}

fn named(trial: &Trial<'_>) -> String {
    format!("trial {} of setting {} (seed {})", trial.trial, trial.setting, trial.scenario.seed)
}

/// Swarm after swarm; each plays trials as long as it is whole and they have as many robots as it.
fn by_processes(plan: &Plan, from: usize, keep: &mut Keeper<'_>) -> anyhow::Result<Option<i32>> {
    let watch = Watch::begin()?;
    let mut next = from;
    while next < plan.len() {
        let before = next;
        if let Some(signal) = one_swarm(plan, &mut next, &watch, keep)? {
            return Ok(Some(signal));
        }
        if next == before {
            return Err(anyhow!("{}: the arena ended without a result", named(&plan.trial(next))));
        }
    }
    Ok(None)
}

/// Plays trials from `next` on by one swarm of processes.
fn one_swarm(
    plan: &Plan,
    next: &mut usize,
    watch: &Watch,
    keep: &mut Keeper<'_>,
) -> anyhow::Result<Option<i32>> {
    let scenario = plan.trial(*next).scenario;
    let robots = scenario.robot_count();
    let (run, owner) = RunDir::create(name::unique(&name::plain(&scenario.name)))?;
    let outcome = (|| {
        fs::write(run.scenario_path(), scenario.to_toml())
            .with_context(|| format!("cannot write {}", run.scenario_path().display()))?;
        let next_trial = Box::new(|record: &str| {
            let trial = plan.trial(*next);
            let record: Record =
                serde_json::from_str(record).context("the arena's record is not understood")?;
            if record.ended == Ending::Interrupted {
                return Ok(None);
            }
            let goes_on = record.squad_is_whole;
            let record = whole(record).with_context(|| named(&trial))?;
            keep(*next, done(plan, &trial, record, &StopFlag::default())?)?;
            *next += 1;
            let following = (goes_on && *next < plan.len()).then(|| plan.trial(*next).scenario);
            Ok(following
                .filter(|scenario| scenario.robot_count() == robots)
                .map(|scenario| scenario.to_toml()))
        });
        supervisor::run(&options(&scenario), &run, robots, None, watch, Some(next_trial))
    })();
    run.remove_own(owner)?;
    outcome.map(|outcome| outcome.signal)
}

/// The arena reads the scenario from the run's folder, and says nothing.
fn options(scenario: &Scenario) -> RunOptions {
    let scenario = ScenarioOptions {
        file: scenario.name.clone().into(),
        robots: None,
        seed: None,
        duration: None,
        sets: Vec::new(),
    };
    RunOptions {
        scenario,
        mode: ModeName::Lockstep,
        speed: None,
        overload: Overload::Report,
        out: None,
        metrics: None,
        no_profile: true,
        trace: TraceOptions::default(),
        log: None,
        quiet: true,
    }
}

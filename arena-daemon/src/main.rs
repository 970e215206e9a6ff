//! The world of a run, as a process: motion, infrared and lamps for agents that join it.

#![forbid(unsafe_code)]

use std::{process, process::ExitCode, sync::Arc};

use agents::{HostConfig, Link, Lockstep, Measure, Realtime, Trials};
use anyhow::Context;
use arena::Arena;
use clap::Parser;
use engine::{Observer, Plan, StopFlag, act::Acts, summary::Summary};
use logging::Format;
use observe::{
    agents::AgentTotals,
    convergence::ConvergenceWarning,
    live::{self, About, Live, SnapshotPublisher, http::Endpoint, stream::Broadcaster},
    log_context::LogContext,
    outputs::Outputs,
    progress::{self, Audience, Progress, Report},
    recorder::Recorder,
    recovery::Recovery,
    trace::Trace,
    trial,
};
use options::{Assignment, PlayOptions, RunOptions, Work};
use processes::signals;
use profile::{ProfileSlot, WatchedCycles};
use protocol::setup::Mode;
use scenario::Scenario;
use squad::Squad;
use transport::{
    control::Event,
    run_dir::{RunDir, RunLock, RunName},
};

/// Play the world of a run: motion, infrared and lamps for robot-agents that join it
///
/// `lamplight run` starts this together with its agents. Started alone, it waits until every
/// robot has been started by hand, and prints summary.json at the end.
#[derive(Debug, Parser)]
#[command(version)]
struct Cli {
    #[command(flatten)]
    run: RunOptions,

    /// Name of the run, which agents join it by
    #[arg(long)]
    name: RunName,
}

/// Command line of an arena with a supervisor, which has left all else in the run's folder.
#[derive(Debug, Parser)]
struct Supervised {
    #[arg(long, required = true)]
    supervised: bool,

    #[arg(long)]
    name: RunName,
}

fn main() -> ExitCode {
    let (is_supervised, outcome) = match Supervised::try_parse() {
        Ok(Supervised { name, .. }) => (true, supervised(name)),
        Err(_) => (false, alone(&Cli::parse())),
    };
    let failure = match &outcome {
        Ok(summary) => summary.as_ref().and_then(Summary::trouble),
        Err(error) => Some(format!("{error:#}")),
    };
    match (is_supervised, outcome) {
        (true, Ok(Some(summary))) => agents::tell(&Event::Summary(summary.json())),
        (true, Err(error)) => agents::tell(&Event::Failed(format!("{error:#}"))),
        (false, Ok(Some(summary))) => print!("{}", summary.json()),
        (_, Ok(None)) | (false, Err(_)) => {}
    }
    match failure {
        // A supervisor says it in its own words.
        Some(_) if is_supervised => ExitCode::FAILURE,
        Some(failure) => {
            logging::fatal(env!("CARGO_CRATE_NAME"), &failure);
            ExitCode::FAILURE
        }
        None => ExitCode::SUCCESS,
    }
}

/// Plays what the supervisor has assigned, which has made the run and will remove it. Returns no summary of trials:
/// their records have been told.
fn supervised(name: RunName) -> anyhow::Result<Option<Summary>> {
    let run = RunDir::of(name);
    let assignment = Assignment::read(&run)?;
    begin_log(run.name(), assignment.work.is_quiet(), Format::from_env().unwrap_or_default(), false);
    let stop = stop_on_signals()?;
    let mut scenario = Scenario::load(&run.scenario_path(), &[])?;
    assignment.tell_places(&mut scenario);
    let (link, trials) = Link::to_supervisor(stop.clone());
    let by_hand = assignment.work.by_hand().cloned();
    let host = HostConfig { run: run.clone(), link, by_hand, measure: None };
    in_run(&run, None, || match assignment.work {
        Work::Run { options, is_shown, .. } => {
            let audience = match is_shown {
                true => Audience::Elsewhere(Box::new(tell_progress)),
                false => Audience::StandardError,
            };
            one_run(&options, &scenario, host, audience, &stop).map(Some)
        }
        Work::Trials => all_trials(scenario, &trials, host, &stop).map(|()| None),
    })
}

/// Plays a run of which every robot is started by hand.
fn alone(cli: &Cli) -> anyhow::Result<Option<Summary>> {
    let options = &cli.run.play;
    begin_log(&cli.name, options.quiet, options.log_format(), true);
    let stop = stop_on_signals()?;
    let scenario = cli.run.load()?;
    let (run, owner) = RunDir::create(cli.name.clone())?;
    in_run(&run, Some(owner), || {
        let host = HostConfig { run: run.clone(), link: Link::none(), by_hand: None, measure: None };
        one_run(options, &scenario, host, Audience::StandardError, &stop).map(Some)
    })
}

fn begin_log(name: &RunName, is_quiet: bool, format: Format, complains: bool) {
    progress::init_log(is_quiet, format, progress::beside_live_line, complains);
    logging::in_run(name);
}

/// Returns a flag that is raised by the signals that end a run; those that stop a process stop it whole.
fn stop_on_signals() -> anyhow::Result<StopFlag> {
    files::survive_size_limit().context("cannot handle signals")?;
    let stop = StopFlag::default();
    signals::raise_on_stop(&stop).context("cannot listen for signals")?;
    signals::stand_still_on_terminal_stop(|stop_this_process| stop_this_process())
        .context("cannot listen for signals")?;
    Ok(stop)
}

/// Does `work` as the living arena of `run`. What is left of it is removed if we are the owner, or that has died.
fn in_run<T>(
    run: &RunDir,
    owner: Option<RunLock>,
    work: impl FnOnce() -> anyhow::Result<T>,
) -> anyhow::Result<T> {
    let alive = run.go_live()?;
    let outcome = work();
    drop((alive, owner));
    // Agents that are still leaving keep what they have mapped; the names are no longer needed.
    run.remove_if_dead().context("cannot clean up after the run")?;
    outcome
}

/// Lets others watch the run and act upon it: over its sockets, and at the address of `--metrics` if there is one.
fn watchable(
    options: &PlayOptions,
    scenario: &Scenario,
    run: &RunDir,
    acts: &Acts,
) -> anyhow::Result<(Arc<Live>, Broadcaster)> {
    let endpoint = options.metrics.map(Endpoint::bind).transpose()?;
    let about = About {
        run: run.name().to_string(),
        scenario: scenario.name.clone(),
        engine: "processes".into(),
        mode: options.mode(),
        arena_pid: process::id(),
    };
    let live = Arc::new(Live::new(about, scenario.ticks(), endpoint.is_some()));
    live::socket::serve(&run.live_path(), Arc::clone(&live))
        .context("cannot make the socket of those who watch")?;
    endpoint.map(|endpoint| endpoint.serve(Arc::clone(&live))).transpose().context("cannot serve metrics")?;
    let broadcaster = Broadcaster::serve(&run.watch_path(), scenario, Arc::clone(&live));
    let broadcaster = broadcaster.context("cannot make the socket of those who watch each tick")?;
    live::acts::serve(&run.acts_path(), acts.clone()).context("cannot make the socket of acts")?;
    Ok((live, broadcaster))
}

fn one_run(
    options: &PlayOptions,
    scenario: &Scenario,
    host: HostConfig,
    audience: Audience,
    stop: &StopFlag,
) -> anyhow::Result<Summary> {
    let mode = options.mode();
    let acts = Acts::default();
    let (live, mut broadcaster) = watchable(options, scenario, &host.run, &acts)?;
    let mut arena = Arena::new(scenario)?;
    let (profile, watched) = (ProfileSlot::default(), WatchedCycles::default());
    let mut outputs = (options.out.as_deref())
        .map(|folder| Outputs::begin(folder, scenario, Arc::clone(&profile)))
        .transpose()?;
    let mut recorder = (options.out.as_deref().zip(options.record))
        .map(|(folder, extent)| Recorder::begin(folder, scenario, extent))
        .transpose()?;
    let mut trace = Trace::begin(&options.trace, scenario, mode).inspect_err(|_| {
        outputs.iter().for_each(Outputs::take_back);
    })?;
    let measure = (!options.no_profile).then(|| Measure {
        profile: Arc::clone(&profile),
        watched: watched.clone(),
        cycles_of: options.trace.traced(scenario),
    });
    let host = HostConfig { measure, ..host };
    let mut squad: Box<dyn Squad> = match mode {
        Mode::Lockstep => Box::new(Lockstep::open(scenario, host, stop.clone())?),
        Mode::Realtime => Box::new(Realtime::open(scenario, host)?),
    };
    let (mut context, mut recovery) = (LogContext, Recovery::new(scenario));
    let mut convergence = ConvergenceWarning::default();
    let (mut totals, mut publisher) = (AgentTotals(profile), SnapshotPublisher::new(live, watched));
    let mut progress = (!options.quiet).then(|| Progress::new(audience));
    let mut observers: Vec<&mut dyn Observer> =
        vec![&mut context, &mut convergence, &mut recovery, &mut totals, &mut publisher, &mut broadcaster];
    observers.extend(progress.as_mut().map(|progress| progress as &mut dyn Observer));
    observers.extend(recorder.as_mut().map(|recorder| recorder as &mut dyn Observer));
    observers.extend(trace.as_mut().map(|trace| trace as &mut dyn Observer));
    // Last, so that its summary has what the others know.
    observers.extend(outputs.as_mut().map(|outputs| outputs as &mut dyn Observer));
    let (speed, overload) = (options.speed, options.overload());
    let plan = Plan { engine: "processes", mode, speed, overload, shares: true };
    Ok(engine::play_under(&acts, scenario, &mut arena, squad.as_mut(), plan, &mut observers, stop))
}

/// Tells the supervisor, which shows it.
fn tell_progress(Report { position, total, text }: Report) {
    agents::tell(&Event::Progress { position, total, text });
}

/// Plays trial after trial by the same agents, the first of `scenario`, and tells each one's record; until
/// there are no more, or the squad can no longer be used.
fn all_trials(scenario: Scenario, trials: &Trials, host: HostConfig, stop: &StopFlag) -> anyhow::Result<()> {
    let mut squad = Lockstep::open_for_trials(&scenario, host, stop.clone())?;
    let mut scenario = scenario;
    loop {
        let record = trial::play(&scenario, &mut squad, "processes", stop)?;
        agents::tell(&Event::Record(serde_json::to_string(&record).context("a record is plain data")?));
        let Some(text) = record.squad_is_whole.then(|| trials.next()).flatten() else { break };
        scenario = Scenario::parse("trial", &text, &[])?;
        squad.begin_anew(&scenario)?;
    }
    squad.end();
    Ok(())
}

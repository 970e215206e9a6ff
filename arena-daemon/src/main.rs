//! The world of a run, as a process: motion, infrared and lamps for agents that join it.

#![forbid(unsafe_code)]

use std::{process, process::ExitCode, sync::Arc};

use agents::{HostConfig, Link, Lockstep, Measure, Realtime, Trials};
use anyhow::Context;
use arena::Arena;
use arena_daemon::{options::RunOptions, trial};
use clap::Parser;
use engine::{Observer, Plan, StopFlag, summary::Summary};
use observe::{
    agents::AgentTotals,
    convergence::ConvergenceWarning,
    live::{self, About, Live, SnapshotPublisher, http::Endpoint},
    log_context::LogContext,
    outputs::Outputs,
    progress::{self, Audience, Progress, Report},
    recovery::Recovery,
    trace::Trace,
};
use processes::signals;
use profile::{ProfileSlot, WatchedCycles};
use protocol::setup::Mode;
use scenario::{RobotSet, Scenario};
use squad::Squad;
use transport::{
    control::Event,
    run_dir::{RunDir, RunName},
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

    /// Robots that the supervisor leaves to be started by hand
    #[arg(long, value_name = "ROBOTS")]
    by_hand: Option<RobotSet>,

    /// Take orders from standard input and report events on standard output
    #[arg(long, hide = true)]
    supervised: bool,

    /// Report progress to the supervisor, which shows it
    #[arg(long, hide = true, requires = "supervised")]
    live: bool,

    /// Play trial after trial, as the supervisor orders
    #[arg(long, hide = true, requires = "supervised")]
    trials: bool,
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    let survives = files::survive_size_limit();
    let (quiet, format) = (cli.run.quiet, cli.run.log_format());
    progress::init_log(quiet, format, progress::beside_live_line, !cli.supervised);
    logging::in_run(&cli.name);
    let outcome = survives.context("cannot handle signals").and_then(|()| run(&cli));
    let failure = match &outcome {
        Ok(Over::Run(summary)) => summary.trouble(),
        Ok(Over::Trials) => None,
        Err(error) => Some(format!("{error:#}")),
    };
    match (cli.supervised, outcome) {
        (true, Ok(Over::Run(summary))) => agents::tell(&Event::Summary(summary.json())),
        (true, Err(error)) => agents::tell(&Event::Failed(format!("{error:#}"))),
        (false, Ok(Over::Run(summary))) => print!("{}", summary.json()),
        (_, Ok(Over::Trials)) | (false, Err(_)) => {}
    }
    match failure {
        // A supervisor says it in its own words.
        Some(_) if cli.supervised => ExitCode::FAILURE,
        Some(failure) => {
            logging::fatal(env!("CARGO_CRATE_NAME"), &failure);
            ExitCode::FAILURE
        }
        None => ExitCode::SUCCESS,
    }
}

/// Result of this process.
enum Over {
    Run(Box<Summary>),
    /// The records of all trials have been told.
    Trials,
}

fn run(cli: &Cli) -> anyhow::Result<Over> {
    let scenario = cli.run.load()?;
    let endpoint = cli.run.metrics.map(Endpoint::bind).transpose()?;
    let stop = StopFlag::default();
    signals::raise_on_stop(&stop).context("cannot listen for signals")?;
    signals::stand_still_on_terminal_stop(|stop_this_process| stop_this_process())
        .context("cannot listen for signals")?;
    let (link, trials) = match cli.supervised {
        true => {
            let (link, trials) = Link::to_supervisor(stop.clone());
            (link, cli.trials.then_some(trials))
        }
        false => (Link::none(), None),
    };
    let (run, owner) = match cli.supervised {
        // The supervisor has made the run and will remove it.
        true => (RunDir::of(cli.name.clone()), None),
        false => RunDir::create(cli.name.clone()).map(|(run, owner)| (run, Some(owner)))?,
    };
    let alive = run.go_live()?;
    let by_hand = cli.by_hand.clone();
    let host = HostConfig { run: run.clone(), link, by_hand, measure: None };
    let over = match trials {
        Some(trials) => play(scenario, &trials, host, &stop).map(|()| Over::Trials),
        None => {
            let live = watchable(cli, &scenario, &run, endpoint)?;
            one_run(cli, &scenario, host, live, &stop).map(|summary| Over::Run(Box::new(summary)))
        }
    };
    drop(alive);
    drop(owner);
    // Does nothing while the supervisor owns the run. Agents that are still leaving keep what they
    // have mapped; the names are no longer needed.
    run.remove_if_dead().context("cannot clean up after the run")?;
    over
}

/// Lets others watch the run: over its socket, and at `endpoint` if there is one.
fn watchable(
    cli: &Cli,
    scenario: &Scenario,
    run: &RunDir,
    endpoint: Option<Endpoint>,
) -> anyhow::Result<Arc<Live>> {
    let about = About {
        run: run.name().to_string(),
        scenario: scenario.name.clone(),
        engine: "processes".into(),
        mode: cli.run.mode(),
        arena_pid: process::id(),
    };
    let live = Arc::new(Live::new(about, scenario.ticks(), endpoint.is_some()));
    live::socket::serve(&run.live_path(), Arc::clone(&live))
        .context("cannot make the socket of those who watch")?;
    endpoint.map(|endpoint| endpoint.serve(Arc::clone(&live))).transpose().context("cannot serve metrics")?;
    Ok(live)
}

fn one_run(
    cli: &Cli,
    scenario: &Scenario,
    host: HostConfig,
    live: Arc<Live>,
    stop: &StopFlag,
) -> anyhow::Result<Summary> {
    let options = &cli.run;
    let mode = options.mode();
    let mut arena = Arena::new(scenario)?;
    let (profile, watched) = (ProfileSlot::default(), WatchedCycles::default());
    let mut outputs = (options.out.as_deref())
        .map(|folder| Outputs::begin(folder, scenario, Arc::clone(&profile)))
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
    let audience = match (options.quiet, cli.live) {
        (true, _) => None,
        (false, true) => Some(Audience::Elsewhere(Box::new(tell_progress))),
        (false, false) => Some(Audience::StandardError),
    };
    let (mut context, mut recovery) = (LogContext, Recovery::new(scenario));
    let mut convergence = ConvergenceWarning::default();
    let (mut totals, mut publisher) = (AgentTotals(profile), SnapshotPublisher::new(live, watched));
    let mut progress = audience.map(Progress::new);
    let mut observers: Vec<&mut dyn Observer> =
        vec![&mut context, &mut convergence, &mut recovery, &mut totals, &mut publisher];
    observers.extend(progress.as_mut().map(|progress| progress as &mut dyn Observer));
    observers.extend(trace.as_mut().map(|trace| trace as &mut dyn Observer));
    // Last, so that its summary has what the others know.
    observers.extend(outputs.as_mut().map(|outputs| outputs as &mut dyn Observer));
    let (speed, overload) = (options.speed, options.overload());
    let plan = Plan { engine: "processes", mode, speed, overload, shares: true };
    Ok(engine::play(scenario, &mut arena, squad.as_mut(), plan, &mut observers, stop))
}

/// Tells the supervisor, which shows it.
fn tell_progress(Report { position, total, text }: Report) {
    agents::tell(&Event::Progress { position, total, text });
}

/// Plays trial after trial by the same agents, the first of `scenario`, and tells each one's record; until
/// there are no more, or the squad can no longer be used.
fn play(scenario: Scenario, trials: &Trials, host: HostConfig, stop: &StopFlag) -> anyhow::Result<()> {
    let mut squad = Lockstep::open(&scenario, host, stop.clone())?;
    let mut next = Some(scenario);
    while let Some(scenario) = next {
        let record = trial::play(&scenario, &mut squad.trial(&scenario), "processes", stop)?;
        agents::tell(&Event::Summary(serde_json::to_string(&record).context("a record is plain data")?));
        let text = if record.squad_is_whole { trials.next() } else { None };
        next = text.map(|text| Scenario::parse("trial", &text, &[])).transpose()?;
    }
    squad.dismiss();
    Ok(())
}

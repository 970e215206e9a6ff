//! The world of a run, as a process: motion, infrared and lamps for agents that join it.

#![forbid(unsafe_code)]

use std::{process, process::ExitCode, sync::Arc};

use anyhow::Context;
use arena::Arena;
use arena_daemon::{
    engine::{self, Plan},
    live::{self, About, Live, http::Endpoint},
    options::RunOptions,
    outputs::Outputs,
    progress::{self, Audience},
    squad::{HostConfig, Squad, lockstep::Lockstep, realtime::Realtime},
    standstill,
    stop::StopFlag,
    summary::Summary,
    supervisor_link::{self, Link, Trials},
    trace::{Traced, Tracer},
    trial,
};
use clap::Parser;
use protocol::setup::Mode;
use scenario::{RobotSet, Scenario};
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
        (true, Ok(Over::Run(summary))) => supervisor_link::tell(&Event::Summary(summary.json())),
        (true, Err(error)) => supervisor_link::tell(&Event::Failed(format!("{error:#}"))),
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
    stop.on_signals().context("cannot listen for signals")?;
    standstill::on_signals(|stop_this_process| stop_this_process()).context("cannot listen for signals")?;
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
    // Nobody reads what the agents of a batch take.
    let profile = !cli.run.no_profile && trials.is_none();
    let mut host =
        HostConfig { run: run.clone(), link, by_hand, profile, live: None, tracer: Tracer::default() };
    let over = match trials {
        Some(trials) => play(scenario, &trials, host, &stop).map(|()| Over::Trials),
        None => {
            host.live = Some(watchable(cli, &scenario, &run, endpoint)?);
            one_run(cli, &scenario, host, &stop).map(|summary| Over::Run(Box::new(summary)))
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
    live::socket::serve(run, Arc::clone(&live)).context("cannot make the socket of those who watch")?;
    endpoint.map(|endpoint| endpoint.serve(Arc::clone(&live))).transpose().context("cannot serve metrics")?;
    Ok(live)
}

fn one_run(cli: &Cli, scenario: &Scenario, host: HostConfig, stop: &StopFlag) -> anyhow::Result<Summary> {
    let mut arena = Arena::new(scenario)?;
    let outputs = Outputs::begin(cli.run.out.as_deref(), scenario)?;
    let mode = cli.run.mode();
    let tracer = Tracer::begin(&cli.run.trace, scenario, mode).inspect_err(|_| outputs.take_back())?;
    let host = HostConfig { tracer: tracer.clone(), ..host };
    let mut squad: Box<dyn Squad> = match mode {
        Mode::Lockstep => Box::new(Lockstep::open(scenario, host, stop.clone())?),
        Mode::Realtime => Box::new(Realtime::open(scenario, host)?),
    };
    if tracer.is_on() {
        squad = Box::new(Traced::new(squad, tracer.clone()));
    }
    let audience = match (cli.run.quiet, cli.live) {
        (true, _) => Audience::Nobody,
        (false, true) => Audience::Supervisor,
        (false, false) => Audience::StandardError,
    };
    let (speed, overload) = (cli.run.speed, cli.run.overload);
    let plan = Plan { engine: "processes", mode, speed, overload, shares: true, audience };
    let observer: &mut engine::Observer<'_> = &mut |arena, _| {
        tracer.tick_ends(arena);
        Ok(())
    };
    let mut summary = engine::run(scenario, &mut arena, squad.as_mut(), plan, outputs, stop, observer);
    summary.unwritten.extend(tracer.finish().err().map(|error| error.to_string()));
    Ok(summary)
}

/// Plays trial after trial by the same agents, the first of `scenario`, and tells each one's record; until
/// there are no more, or the squad can no longer be used.
fn play(scenario: Scenario, trials: &Trials, host: HostConfig, stop: &StopFlag) -> anyhow::Result<()> {
    let mut squad = Lockstep::open(&scenario, host, stop.clone())?;
    let mut next = Some(scenario);
    while let Some(scenario) = next {
        let record = trial::play(&scenario, &mut squad.trial(&scenario), "processes", stop)?;
        supervisor_link::tell(&Event::Summary(
            serde_json::to_string(&record).context("a record is plain data")?,
        ));
        let text = if record.squad_is_whole { trials.next() } else { None };
        next = text.map(|text| Scenario::parse("trial", &text, &[])).transpose()?;
    }
    squad.dismiss();
    Ok(())
}

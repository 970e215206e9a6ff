//! `lamplight run`: one scenario, one engine.

use std::{
    io::{self, IsTerminal},
    process,
    sync::Arc,
};

use ::view::{Server, Serving};
use anyhow::{Context, anyhow};
use arena::{
    Arena, placement,
    plan_warnings::{named, warnings},
};
use clap::{Args, ValueEnum};
use engine::{
    Observer, Plan, StopFlag,
    summary::{Ending, Summary},
};
use observe::{
    live::{About, Live, SnapshotPublisher, http::Endpoint},
    log_context::LogContext,
    outputs::{self, Outputs},
    progress::{Audience, Progress},
    recorder::Recorder,
    recovery::Recovery,
};
use options::{PlayOptions, RunOptions, Work};
use processes::signals::{exit_status, raise_on_stop};
use profile::{ProfileSlot, WatchedCycles};
use protocol::setup::Mode;
use scenario::{RobotSet, Scenario, ScenarioError};
use signal_hook::consts::SIGTERM;
use transport::run_dir::{RunDir, RunName};

use crate::{
    failure::Failure,
    in_process, limits, log, name,
    outcome::Outcome,
    status::Status,
    stdout::say,
    summary_text,
    supervisor::{self, Watch},
    view::{self, ViewOptions},
};

/// Engine that runs the robots.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum Engine {
    /// A process per robot
    #[default]
    Processes,
    /// One loop in one process: the same results, faster, for large batches
    InProcess,
}

impl Engine {
    /// As the command line spells it.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Processes => "processes",
            Self::InProcess => "in-process",
        }
    }
}

#[derive(Args, Debug)]
pub(crate) struct RunArgs {
    #[command(flatten)]
    options: RunOptions,

    #[command(flatten)]
    view: ViewOptions,

    /// Engine that runs the robots
    #[arg(long, value_enum, default_value_t)]
    engine: Engine,

    /// Print summary.json on standard output
    #[arg(long)]
    json: bool,

    /// Fail if a planned fault never fired
    #[arg(long)]
    strict_faults: bool,

    /// Fail if what a controller states with `always` did not hold
    #[arg(long)]
    strict_properties: bool,

    /// Name of the run, for those who watch it or join by hand [default: SCENARIO-RANDOM, such as swarmbots-k3x8mq2f]
    #[arg(long)]
    name: Option<RunName>,

    /// Leave these robots to be started by hand (robot-agent --run NAME --robot N), such as 0-7,9; they are waited
    /// for without limit, unless the scenario sets processes.join_timeout_s
    #[arg(long, value_name = "ROBOTS")]
    by_hand: Option<RobotSet>,
}

pub(crate) fn run(args: &RunArgs) -> Result<Status, Failure> {
    log::begin(args.options.play.quiet, args.options.play.log_format());
    if let (Engine::Processes, Some(Ok(robots))) =
        (args.engine, args.options.scenario.robots.map(u32::try_from))
    {
        // The first limit a larger swarm meets, and the one a user can do something about.
        if args.options.scenario.file.is_file() {
            limits::prepare(robots, args.options.play.mode().plane()).map_err(Failure::Usage)?;
        }
    }
    let mut scenario = args.options.load().map_err(Failure::usage)?;
    match args.engine {
        Engine::InProcess => in_process::prepare(&mut scenario, in_process::INSTEAD),
        Engine::Processes => scenario.find_controllers(),
    }
    .map_err(Failure::usage)?;
    let poses = placement::start(&scenario).map_err(Failure::usage)?;
    let name = args.name.clone().unwrap_or_else(|| name::unique(&name::plain(&scenario.name)));
    logging::in_run(&name);
    log::warn_of(&warnings(&scenario, &poses));
    let outcome = match args.engine {
        Engine::InProcess => in_one_process(args, &scenario)?,
        Engine::Processes => processes(args, &scenario, name)?,
    };
    let Some(summary) = outcome.summary else {
        logging::fatal(env!("CARGO_CRATE_NAME"), "ended at once; there is no summary");
        return Ok(interrupted(outcome.signal));
    };
    say(&if args.json { summary.json() } else { summary_text::lines(&summary) })?;
    let trouble = summary.trouble();
    if summary.ended == Ending::Interrupted {
        trouble.iter().for_each(|what| tracing::warn!("{what}"));
        return Ok(interrupted(outcome.signal));
    }
    if let Some(what) = trouble {
        return Err(Failure::Run(anyhow!(what)));
    }
    let idle = never_fired(&scenario, &summary);
    idle.iter().for_each(|fault| tracing::warn!("{fault} never fired"));
    let broken: Vec<String> = summary.properties.broken().map(summary_text::broken).collect();
    broken.iter().for_each(|what| tracing::warn!("{what}"));
    match (args.strict_faults, idle.len(), args.strict_properties, broken.len()) {
        (true, 1.., ..) => {
            Err(Failure::Run(anyhow!("{} of {} faults never fired", idle.len(), scenario.fault.len())))
        }
        (.., true, 1..) => {
            let all = summary.properties.always.len();
            Err(Failure::Run(anyhow!("{} of {all} that must always hold did not", broken.len())))
        }
        _ => Ok(Status::SUCCESS),
    }
}

/// The faults of the plan that did nothing.
fn never_fired(scenario: &Scenario, summary: &Summary) -> Vec<String> {
    let plan = scenario.fault.iter().enumerate().zip(&summary.faults);
    plan.filter(|(_, fault)| fault.line.fired_tick.is_none())
        .map(|((index, fault), _)| named(index, fault))
        .collect()
}

fn in_one_process(args: &RunArgs, scenario: &Scenario) -> Result<Outcome, Failure> {
    let options = &args.options.play;
    if options.mode() == Mode::Realtime {
        let message =
            "the in-process engine has virtual time only; use --engine processes for --mode realtime";
        return Err(Failure::Usage(anyhow!(message)));
    }
    if args.name.is_some() || args.by_hand.is_some() {
        let message = "--name and --by-hand are about processes; use --engine processes";
        return Err(Failure::Usage(anyhow!(message)));
    }
    if args.view.view.is_some() {
        let message = "--view watches processes; with --engine in-process, --record it and show the recording by \
                       `lamplight replay --view`";
        return Err(Failure::Usage(anyhow!(message)));
    }
    if options.trace.file.is_some() {
        let message = "--trace shows processes, and the in-process engine has none; use --engine processes";
        return Err(Failure::Usage(anyhow!(message)));
    }
    let mut arena = Arena::new(scenario).map_err(Failure::usage)?;
    let live = watchable(options, scenario)?;
    prepare_out(options)?;
    let stop = StopFlag::default();
    raise_on_stop(&stop).context("cannot listen for signals").map_err(Failure::Run)?;
    let outputs = options.out.as_deref().map(|out| Outputs::begin(out, scenario, ProfileSlot::default()));
    let mut outputs = outputs.transpose().map_err(Failure::Run)?;
    let mut recorder = (options.out.as_deref().zip(options.record))
        .map(|(folder, extent)| Recorder::begin(folder, scenario, extent))
        .transpose()?;
    let mut progress = (!options.quiet).then(|| Progress::new(Audience::StandardError));
    let mut publisher = live.map(|live| SnapshotPublisher::new(live, WatchedCycles::default()));
    let (mut context, mut recovery) = (LogContext, Recovery::new(scenario));
    let mut observers: Vec<&mut dyn Observer> = vec![&mut context, &mut recovery];
    observers.extend(publisher.as_mut().map(|publisher| publisher as &mut dyn Observer));
    observers.extend(recorder.as_mut().map(|recorder| recorder as &mut dyn Observer));
    observers.extend(progress.as_mut().map(|progress| progress as &mut dyn Observer));
    observers.extend(outputs.as_mut().map(|outputs| outputs as &mut dyn Observer));
    let plan = Plan { speed: options.speed, ..Plan::IN_PROCESS };
    let mut squad = in_process::squad(scenario).map_err(Failure::usage)?;
    let summary = engine::play(scenario, &mut arena, &mut *squad, plan, &mut observers, &stop);
    Ok(Outcome { summary: Some(summary), signal: stop.signal() })
}

/// Where those are told who read metrics, if somebody shall.
fn watchable(options: &PlayOptions, scenario: &Scenario) -> Result<Option<Arc<Live>>, Failure> {
    let Some(address) = options.metrics else { return Ok(None) };
    let endpoint = Endpoint::bind(address).map_err(Failure::usage)?;
    let about = About {
        run: scenario.name.clone(),
        scenario: scenario.name.clone(),
        engine: Engine::InProcess.name().into(),
        mode: options.mode(),
        arena_pid: process::id(),
    };
    let live = Arc::new(Live::new(about, scenario.ticks(), true));
    endpoint.serve(Arc::clone(&live)).map_err(Failure::run)?;
    Ok(Some(live))
}

fn processes(args: &RunArgs, scenario: &Scenario, name: RunName) -> Result<Outcome, Failure> {
    let robots = scenario.robot_count();
    if let Some(set) = args.by_hand.as_ref().filter(|set| set.highest() >= robots) {
        let message = format!("--by-hand {set}: the scenario has robots 0 to {}", robots - 1);
        return Err(Failure::Usage(anyhow!(message)));
    }
    // The arena will take it; that it cannot is to be known before anything is started.
    args.options.play.metrics.map(Endpoint::bind).transpose().map_err(Failure::usage)?;
    limits::prepare(robots, scenario.plane(args.options.play.mode())).map_err(Failure::Usage)?;
    let page = args.view.view.map(Server::bind).transpose().map_err(Failure::usage)?;
    let watch = Watch::begin().map_err(Failure::Run)?;
    let (run, owner) = RunDir::create(name).map_err(Failure::usage)?;
    let shown = |page| view::serve(page, view::of_run(&run, scenario.clone(), args.options.play.mode())?);
    let page = page.map(shown).transpose()?;
    let outcome = supervised(args, scenario, &run, &watch);
    page.into_iter().for_each(Serving::end);
    let removed = run.remove_own(owner).map_err(Failure::run);
    outcome.and_then(|outcome| removed.map(|()| outcome))
}

/// Runs the processes of a run that is ours.
fn supervised(args: &RunArgs, scenario: &Scenario, run: &RunDir, watch: &Watch) -> Result<Outcome, Failure> {
    let (options, by_hand) = (args.options.play.clone(), args.by_hand.clone());
    prepare_out(&options)?;
    let work = Work::Run { options, by_hand, is_shown: io::stderr().is_terminal() };
    // What a scenario names and cannot be started is known before a robot has moved.
    supervisor::run(work, run, scenario, watch, None).map_err(|error| match error.is::<ScenarioError>() {
        true => Failure::Usage(error),
        false => Failure::Run(error),
    })
}

/// Exit status of an interrupted run. If it was the arena alone that was told to end, then by SIGTERM.
fn interrupted(signal: Option<i32>) -> Status {
    Status(exit_status(signal.unwrap_or(SIGTERM)))
}

/// Finds out that results cannot be written before a robot has moved; from here on the log is kept there too.
fn prepare_out(options: &PlayOptions) -> Result<(), Failure> {
    if let Some(folder) = options.out.as_deref() {
        outputs::prepare(folder).map_err(Failure::Usage)?;
        log::keep_in(folder);
    }
    Ok(())
}

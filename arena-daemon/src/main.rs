//! The world of a run, as a process: motion, infrared and lamps for agents that join it.

#![forbid(unsafe_code)]

use std::{collections::BTreeSet, process::ExitCode};

use anyhow::Context;
use arena::Arena;
use arena_daemon::{
    engine::{self, Plan},
    link::{self, Link},
    options::RunOptions,
    outputs::Outputs,
    progress,
    squad::{Hosting, Squad, lockstep::Lockstep, realtime::Realtime},
    stop::StopFlag,
    summary::{Ending, Summary},
};
use clap::Parser;
use protocol::{
    control::Event,
    run_dir::{RunDir, RunName},
    setup::Mode,
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
    #[arg(long, value_name = "ROBOTS", value_delimiter = ',')]
    by_hand: Vec<u32>,

    /// Take orders from standard input and report events on standard output
    #[arg(long, hide = true)]
    supervised: bool,
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    progress::init_log(cli.run.quiet);
    match run(&cli) {
        Ok(Summary { ended: Ending::Failed, failure, .. }) => {
            tracing::error!("{}", failure.unwrap_or_default());
            ExitCode::FAILURE
        }
        Ok(_) => ExitCode::SUCCESS,
        Err(error) => {
            tracing::error!("{error:#}");
            ExitCode::FAILURE
        }
    }
}

fn run(cli: &Cli) -> anyhow::Result<Summary> {
    let scenario = cli.run.load()?;
    let arena = Arena::new(&scenario)?;
    let stop = StopFlag::default();
    stop.on_signals().context("cannot listen for signals")?;
    let link = match cli.supervised {
        true => Link::to_supervisor(stop.clone()),
        false => Link::none(),
    };
    let outputs = Outputs::begin(cli.run.out.as_deref(), &scenario)?;
    let (run, lock) = RunDir::create(cli.name.clone())?;
    let by_hand = cli.by_hand.iter().copied().collect::<BTreeSet<_>>();
    let hosting = Hosting { run: run.clone(), link, by_hand };
    let mode = cli.run.mode();
    let summary = (|| {
        let mut squad: Box<dyn Squad> = match mode {
            Mode::Lockstep => Box::new(Lockstep::open(&scenario, hosting, stop.clone())?),
            Mode::Realtime => Box::new(Realtime::open(&scenario, hosting)?),
        };
        let plan = Plan { engine: "processes", mode, speed: cli.run.speed, quiet: cli.run.quiet };
        engine::run(&scenario, arena, squad.as_mut(), plan, outputs, &stop)
    })();
    // Agents that are still leaving keep what they have mapped; the names are no longer needed.
    run.remove().context("cannot clean up after the run")?;
    drop(lock);
    let summary = summary?;
    match cli.supervised {
        true => link::tell(&Event::Summary(summary.json())),
        false => print!("{}", summary.json()),
    }
    Ok(summary)
}

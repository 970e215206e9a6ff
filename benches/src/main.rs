//! What a tick costs: a bare futex tick, our lock-step tick and our in-process tick, side by side.
//!
//! The three are measured in turn, round by round, so that what else the machine does falls on
//! all of them alike. Progress goes to standard error, the result (Markdown) to standard output.

#![forbid(unsafe_code)]

mod floor;
mod lamplight;
mod machine;
mod spread;
mod table;

use std::{path::PathBuf, process::ExitCode};

use anyhow::ensure;
use clap::{Args, Parser, Subcommand};

use crate::{
    floor::{AgentArgs, Floor, ROBOTS_MAX},
    lamplight::{Engine, Lamplight},
    table::{Measurements, Round},
};

/// Measure what a tick costs, beside the least it could cost
///
/// Prints a Markdown table. Run it on a quiet machine: a tick of N processes is N context
/// switches, and whatever else runs gets in between.
#[derive(Debug, Parser)]
#[command(version, args_conflicts_with_subcommands = true)]
struct Cli {
    #[command(flatten)]
    bench: BenchArgs,

    #[command(subcommand)]
    internal: Option<Internal>,
}

#[derive(Args, Debug)]
struct BenchArgs {
    /// Swarm sizes to measure
    #[arg(long, value_name = "N,N,..", value_delimiter = ',', default_value = "10,100,1000")]
    robots: Vec<u32>,

    /// How often each is measured, in turn with the others
    #[arg(long, value_name = "COUNT", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..))]
    rounds: u32,

    /// Ticks of each measurement; its result is their median
    #[arg(long, value_name = "COUNT", default_value_t = 300, value_parser = clap::value_parser!(u32).range(1..))]
    ticks: u32,

    /// Scenario to run, with 50 robots on a square of 2.4384 m; other sizes get its density
    #[arg(long, value_name = "FILE", default_value = "scenarios/swarmbots.toml")]
    scenario: PathBuf,

    /// Set any key of the scenario, such as channel.range_m=0.6; may be repeated
    #[arg(long = "set", value_name = "KEY.PATH=VALUE")]
    sets: Vec<String>,
}

#[derive(Debug, Subcommand)]
enum Internal {
    /// One process of the floor; started by this program only
    #[command(hide = true)]
    FloorAgent(AgentArgs),
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    let done = match &cli.internal {
        Some(Internal::FloorAgent(agent)) => floor::agent(agent),
        None => bench(&cli.bench),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn bench(args: &BenchArgs) -> anyhow::Result<()> {
    for &robots in &args.robots {
        ensure!((1..=ROBOTS_MAX).contains(&robots), "--robots {robots}: it must be 1 to {ROBOTS_MAX}");
    }
    let lamplight = Lamplight::beside_us(&args.scenario, &args.sets)?;
    let mut measurements: Vec<_> = args.robots.iter().map(|&robots| Measurements::of(robots)).collect();
    for round in 1..=args.rounds {
        for size in &mut measurements {
            eprintln!("round {round} of {}: {} robots", args.rounds, size.robots);
            size.rounds.push(measure(&lamplight, size.robots, args.ticks)?);
        }
    }
    println!("{}\n", machine::described());
    print!("{}", table::markdown(&measurements));
    Ok(())
}

fn measure(lamplight: &Lamplight, robots: u32, ticks: u32) -> anyhow::Result<Round> {
    let floor = Floor::raise(robots)?.median_tick(ticks)?;
    let lockstep = lamplight.run(Engine::Lockstep, robots, ticks)?;
    let in_process = lamplight.run(Engine::InProcess, robots, ticks)?;
    ensure!(
        lockstep.digest == in_process.digest,
        "the engines disagree at {robots} robots: lock-step came to digest {}, in-process to {}",
        lockstep.digest,
        in_process.digest
    );
    Ok(Round {
        floor_us: floor.as_secs_f64() * 1e6,
        lockstep_us: lockstep.tick_us.p50,
        in_process_us: in_process.tick_us.p50,
        heard: lockstep.heard_per_robot_and_tick(),
    })
}

//! One robot, as a process: hear its neighbors, sense the light, steer to the centroid of its cell.

#![forbid(unsafe_code)]

mod agent;
mod lockstep;
mod realtime;

use std::{fs, io, process::ExitCode};

use anyhow::Context;
use clap::Parser;
use protocol::{
    codec,
    doorbell::Doorbell,
    robot_id::RobotId,
    run_dir::{RunDir, RunName},
    services::{Medium, ServiceError},
    setup::{AgentSetup, Mode},
};
use tracing_subscriber::EnvFilter;

use crate::agent::Agent;

/// Drive one robot: hear its neighbors, steer to the centroid of its cell
///
/// `lamplight run` starts one of these per robot. Started by hand, it joins a run that waits for
/// it (`lamplight run SCENARIO --name lab --by-hand 7`, then `robot-agent --run lab --robot 7`).
#[derive(Debug, Parser)]
#[command(version)]
struct Cli {
    /// Name of the run to join
    #[arg(long)]
    run: RunName,

    /// Robot number in the swarm, starting at 0
    #[arg(long, value_name = "N")]
    robot: u32,

    /// How often this robot's agent has been restarted
    #[arg(long, value_name = "K", default_value_t = 0)]
    incarnation: u16,
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new("warn"));
    tracing_subscriber::fmt().with_env_filter(filter).with_writer(io::stderr).without_time().init();
    match drive(cli) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn drive(cli: Cli) -> anyhow::Result<()> {
    let id = RobotId { index: cli.robot, incarnation: cli.incarnation };
    let run = RunDir::open(cli.run)?;
    let setup = fs::read(run.setup_path()).context("cannot read the run's setup")?;
    let setup: AgentSetup = codec::decode(&setup)?;
    let bell = Doorbell::open(&run.doorbell_path()).context("cannot open the run's doorbell")?;
    let ports = Medium::enter(&run)?.join(id).map_err(|error| explained(error, &run))?;
    let agent = Agent::new(id, setup.controller, ports);
    match setup.mode {
        Mode::Lockstep => lockstep::run(agent, &bell, &run),
        Mode::Realtime => realtime::run(agent, &bell, &run, setup.step),
    }
}

/// What a user can do about a robot that cannot be driven.
fn explained(error: ServiceError, run: &RunDir) -> anyhow::Error {
    let name = run.name();
    match error {
        ServiceError::Taken(_) => {
            anyhow::anyhow!("{error} in run `{name}`; end that agent first, or drive another robot")
        }
        ServiceError::Unknown(_) => anyhow::anyhow!("{error} (run `{name}`); robots count from 0"),
        error => error.into(),
    }
}

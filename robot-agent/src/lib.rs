//! A robot's process around any [`Controller`]: joining a run, lock-step and real time, profile, log, leaving.
//!
//! A whole agent is one call, with what makes a controller of the robot's id and its parameters. The paper's is
//!
//! ```no_run
//! use std::process::ExitCode;
//!
//! use coverage::CoverageController;
//!
//! fn main() -> ExitCode {
//!     robot_agent::main(|robot, params| {
//!         params.decode().map(|setup| CoverageController::new(robot, setup))
//!     })
//! }
//! ```

#![forbid(unsafe_code)]

mod abandoned;
mod agent;
mod lockstep;
mod realtime;
mod refusal;
mod stopwatch;
mod timer;

use std::{
    any::Any,
    env,
    ffi::OsString,
    fmt,
    io::{self, IsTerminal},
    panic::{self, AssertUnwindSafe},
    process::{self, ExitCode},
    thread,
    time::Duration,
};

use anyhow::{Context, bail};
use clap::Parser;
use logging::Settings;
use protocol::{
    controller::Controller,
    giving_up::GaveUp,
    robot_id::RobotId,
    setup::{AgentSetup, Mode},
};
use rustix::process::{Resource, Rlimit, Signal, set_parent_process_death_signal, setrlimit};
use tracing::level_filters::LevelFilter;
use transport::{
    doorbell::Doorbell,
    ends::ServiceError,
    footprint,
    run_dir::{ArenaWatch, ByHand, RunDir, RunDirError, RunName},
    services::Session,
};

pub use protocol::params::Params;

use crate::{abandoned::Abandoned, agent::Agent, refusal::Refusal};

/// How often an early agent looks whether its run is ready.
const READY_POLL: Duration = Duration::from_millis(10);

/// Drive one robot of a run
///
/// `lamplight run` starts one of these per robot. Started by hand, it joins a run that waits for
/// it (`lamplight run SCENARIO --name lab --by-hand 7`, then this program with `--run lab --robot 7`).
// Not by the name of this crate: the program is its user's.
#[derive(Debug, Parser)]
#[command(name = "agent", version = concat!("of Lamplight ", env!("CARGO_PKG_VERSION")))]
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

    /// Leave without a word when the run goes on without this robot, or its arena dies
    #[arg(long)]
    quiet: bool,
}

/// Runs the agent of one robot: reads the command line, joins the run it names, and answers with a controller that
/// `new` makes of the robot's id and its parameters, anew for each trial. Returns when the run ends; at once, with the
/// words of `new`, if that refuses them. A controller that [gives up](protocol::giving_up) ends the process with its words.
pub fn main<C: Controller, E: fmt::Display>(new: impl Fn(RobotId, &Params) -> Result<C, E>) -> ExitCode {
    let program = env::current_exe().unwrap_or_default().display().to_string();
    run(env::args_os(), &program, new)
}

/// Does what [`main`] does, with the `words` of another command line, of which the first is passed over: for a process
/// that is more than an agent, such as an interpreter. `program` is what messages call the controller.
pub fn run<C: Controller, E: fmt::Display>(
    words: impl IntoIterator<Item = OsString>,
    program: &str,
    new: impl Fn(RobotId, &Params) -> Result<C, E>,
) -> ExitCode {
    let cli = match Cli::try_parse_from(words) {
        Ok(cli) => cli,
        Err(error) => return refuse(&error),
    };
    if cli.quiet {
        // Whoever has started it is gone then, and it might hang. That there was nobody already, it finds out itself.
        let _ = set_parent_process_death_signal(Some(Signal::KILL));
    }
    logging::begin(Settings {
        format: logging::Format::from_env().unwrap_or_default(),
        level: LevelFilter::WARN,
        robot: Some(RobotId { index: cli.robot, incarnation: cli.incarnation }),
        color: io::stderr().is_terminal(),
        sink: logging::to_stderr,
        // Whoever has started a quiet agent has been told what is wrong already.
        complains: !cli.quiet,
    });
    logging::in_run(&cli.run);
    let outcome = match panic::catch_unwind(AssertUnwindSafe(|| drive(&cli, program, new))) {
        Ok(outcome) => outcome,
        Err(panicked) => Err(gave_up(panicked)),
    };
    let over = is_over(&cli.run);
    if over && !cli.quiet {
        // Services that were joined while the run was taken down would stay. Whoever started this
        // agent by hand is the last who could remove them; a run that is not dead is not touched.
        let _ = RunDir::of(cli.run.clone()).remove_if_dead();
    }
    let Err(error) = outcome else { return ExitCode::SUCCESS };
    let message = match (error.is::<Abandoned>() || error.is::<RunDirError>(), over) {
        (false, true) => format!("run `{}` has ended", cli.run),
        _ => format!("{error:#}"),
    };
    if error.is::<ControllerError>() {
        // With the tick.
        tracing::error!("{error}");
        return ExitCode::FAILURE;
    }
    let is_known =
        over || error.is::<Abandoned>() || error.downcast_ref().is_some_and(|it| is_told(&cli.run, it));
    if !(cli.quiet && is_known) {
        logging::fatal(env!("CARGO_CRATE_NAME"), &message);
    }
    ExitCode::FAILURE
}

/// Its controller could not go on.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
struct ControllerError(String);

/// The error of a controller that has given up; any other panic goes on.
fn gave_up(panicked: Box<dyn Any + Send>) -> anyhow::Error {
    match panicked.downcast::<GaveUp>() {
        Ok(words) => ControllerError(words.0).into(),
        Err(panicked) => panic::resume_unwind(panicked),
    }
}

/// Says why the command line is refused, or what was asked for. In one write: a swarm's agents share one pipe, and
/// lines that come in pieces would mix.
fn refuse(error: &clap::Error) -> ExitCode {
    let text = error.render();
    let text = if io::stderr().is_terminal() { text.ansi().to_string() } else { text.to_string() };
    // If nobody takes it, there is nobody to tell.
    let _ = match error.use_stderr() {
        true => logging::to_stderr(text.as_bytes()),
        false => error.print(),
    };
    ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(2))
}

/// Whether another robot has told the reason already, which in a swarm is mostly the same for all.
fn is_told(name: &RunName, refusal: &Refusal) -> bool {
    !RunDir::of(name.clone()).is_first_to_say(&refusal.reason)
}

/// Whether a run has ended, or is about to: then what failed is of no interest.
fn is_over(name: &RunName) -> bool {
    RunDir::open(name.clone())
        .map_or(true, |(run, _)| Doorbell::open(&run.doorbell_path()).is_ok_and(|bell| bell.is_closed()))
}

/// A robot that has taken its place in a run.
struct Joined<C, N> {
    setup: AgentSetup,
    run: RunDir,
    arena: ArenaWatch,
    bell: Doorbell,
    agent: Agent<C, N>,
}

fn drive<C: Controller, E: fmt::Display>(
    cli: &Cli,
    program: &str,
    new: impl Fn(RobotId, &Params) -> Result<C, E>,
) -> anyhow::Result<()> {
    let mut joined = join(cli, program, |id, params: &Params| {
        new(id, params).map_err(|reason| Refusal::new(id, program, "refuses its params", reason).into())
    })?;
    footprint::trim();
    let Joined { setup, run, arena, bell, agent } = &mut *joined;
    tracing::debug!(pid = process::id(), "has joined");
    let outcome = match setup.mode {
        Mode::Lockstep => lockstep::run(agent, bell, run, arena),
        Mode::Realtime => realtime::run(agent, bell, run, arena, setup),
    };
    tracing::debug!("leaves");
    outcome
}

/// Needs much more stack than what follows, hence a frame of its own, and its outcome is not on the stack.
#[inline(never)]
fn join<C: Controller, N: Fn(RobotId, &Params) -> anyhow::Result<C>>(
    cli: &Cli,
    program: &str,
    new: N,
) -> anyhow::Result<Box<Joined<C, N>>> {
    let id = RobotId { index: cli.robot, incarnation: cli.incarnation };
    let (run, arena) = RunDir::open(cli.run.clone())?;
    wait_until_ready(&run, &arena)?;
    // First, because it knows versions: nothing else of another one need make sense.
    let bell = Doorbell::open(&run.doorbell_path())
        .map_err(|reason| Refusal::new(id, program, "cannot join the run", reason))?;
    if !cli.quiet {
        check_place(&run, id)?;
    }
    let setup = agent::setup_of(&run, id)?;
    if let Some(bytes) = setup.memory_max_bytes {
        let limit = Rlimit { current: Some(bytes), maximum: Some(bytes) };
        setrlimit(Resource::Data, limit).context("cannot set the limit of its memory")?;
    }
    let ports = Session::enter(&run)?
        .join(id, setup.plane, setup.payload_bytes_max.into())
        .map_err(|error| explained(error, &run))?;
    let agent = Agent::new(id, program, &run, &setup, ports, new)?;
    Ok(Box::new(Joined { setup, run, arena, bell, agent }))
}

/// An agent started by hand may come before the arena has everything laid out.
fn wait_until_ready(run: &RunDir, arena: &ArenaWatch) -> anyhow::Result<()> {
    while !run.doorbell_path().exists() {
        if !arena.is_alive() {
            bail!("run `{}` has ended before it began", run.name());
        }
        thread::sleep(READY_POLL);
    }
    Ok(())
}

/// Whether a user may drive this life of a robot. If somebody else drives it, joining will tell.
fn check_place(run: &RunDir, id: RobotId) -> anyhow::Result<()> {
    let name = run.name();
    let by_hand = run.by_hand().context("cannot read which robots are driven by hand")?;
    let present = by_hand.iter().find(|robot| robot.id.index == id.index);
    match present {
        Some(present) if present.id == id => Ok(()),
        Some(ByHand { id: present, is_awaited: true, program }) => {
            let command = name.agent_command(program, *present);
            bail!("run `{name}` waits for {present} and not for {id}: {command}")
        }
        Some(ByHand { id: present, .. }) => {
            bail!("run `{name}` does not wait for {id}; it is at {present}, which has been started already")
        }
        None => match by_hand.iter().find(|robot| robot.is_awaited) {
            Some(other) => bail!(
                "{id} is not driven by hand in run `{name}`, which waits for {}: {}",
                other.id,
                name.agent_command(&other.program, other.id)
            ),
            None => bail!(
                "{id} is not driven by hand in run `{name}`; to drive it, start a run with --by-hand {}",
                id.index
            ),
        },
    }
}

/// Adds a way out to the error about a robot that cannot be driven.
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

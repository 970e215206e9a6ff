//! `lamplight check`: is this scenario sound?

use std::{path::PathBuf, process::ExitCode};

use arena::{Arena, scenario::Scenario};
use clap::Args;

use crate::{failure::Failure, say::say};

#[derive(Args, Debug)]
pub(crate) struct CheckArgs {
    /// Scenario file (TOML)
    scenario: PathBuf,
}

pub(crate) fn check(args: &CheckArgs) -> Result<ExitCode, Failure> {
    let scenario = Scenario::load(&args.scenario, &[]).map_err(Failure::usage)?;
    Arena::new(&scenario).map_err(Failure::usage)?;
    say(&format!(
        "{}: sound: {} robots, {} ticks of {} s\n",
        args.scenario.display(),
        scenario.robot_count(),
        scenario.ticks(),
        scenario.step_s.get()
    ))?;
    Ok(ExitCode::SUCCESS)
}

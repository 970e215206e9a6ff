//! `lamplight check`: is this scenario sound?

use arena::{Arena, plan_warnings::warnings};
use clap::Args;
use logging::Format;
use options::ScenarioOptions;

use crate::{failure::Failure, log, status::Status, stdout::say};

#[derive(Args, Debug)]
pub(crate) struct CheckArgs {
    #[command(flatten)]
    options: ScenarioOptions,
}

pub(crate) fn check(args: &CheckArgs) -> Result<Status, Failure> {
    let mut scenario = args.options.load().map_err(Failure::usage)?;
    scenario.find_controllers().map_err(Failure::usage)?;
    let arena = Arena::new(&scenario).map_err(Failure::usage)?;
    log::begin(false, Format::Text);
    log::warn_of(&warnings(&scenario, arena.poses()));
    say(&format!(
        "{}: sound: {} robots, {} ticks of {} s, {} faults\n",
        args.options.file.display(),
        scenario.robot_count(),
        scenario.ticks(),
        scenario.step_s.get(),
        scenario.fault.len()
    ))?;
    Ok(Status::SUCCESS)
}

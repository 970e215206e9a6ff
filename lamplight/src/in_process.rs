//! Runs by the in-process engine: one for `run`, many for `batch`, `shrink` and `fuzz`.

use std::panic::{self, AssertUnwindSafe};

use anyhow::bail;
use arena::Arena;

use coverage::{CoverageController, setup::CoverageSetup};
use engine::{InProcess, Observer, Plan, StopFlag, summary::Summary};
use observe::{
    recovery::Recovery,
    trial::{self, Record},
};
use protocol::robot_id::RobotId;
use scenario::Scenario;
use squad::Squad;

/// Runs `scenario` as fast as it can, silently and without outputs, as one run of many, told to `observers`. A panic ends
/// this run alone.
pub(crate) fn run_quietly(
    scenario: &Scenario,
    stop: &StopFlag,
    observers: Vec<&mut dyn Observer>,
) -> anyhow::Result<Summary> {
    guarded(|| {
        let (mut arena, mut squad) = (Arena::new(scenario)?, squad(scenario));
        let mut recovery = Recovery::new(scenario);
        let mut all: Vec<&mut dyn Observer> = vec![&mut recovery];
        all.extend(observers.into_iter().map(|observer| observer as &mut dyn Observer));
        let plan = Plan { shares: false, ..Plan::IN_PROCESS };
        Ok(engine::play(scenario, &mut arena, &mut squad, plan, &mut all, stop))
    })
}

/// Plays one trial of a batch. A panic ends this trial alone.
pub(crate) fn trial(scenario: &Scenario, stop: &StopFlag) -> anyhow::Result<Record> {
    guarded(|| trial::play(scenario, &mut squad(scenario), "in-process", stop))
}

/// Way out for scenarios in which programs think for robots.
pub(crate) const INSTEAD: &str = "this plays robots in one process, without programs; `lamplight run --engine processes` plays them, and \
     so does the crate `engine` with a constructor of your controller";

/// The paper's controller for every robot of `scenario`, in which no programs are.
pub(crate) fn squad(scenario: &Scenario) -> impl Squad {
    let setup = |robot| scenario.coverage_setup(robot).expect("programs were refused");
    let setups: Vec<CoverageSetup> = (0..scenario.robot_count()).map(setup).collect();
    let new = move |id: RobotId| Ok(CoverageController::new(id, setups[id.index as usize]));
    InProcess::new(scenario, 0..scenario.robot_count(), new).expect("no setup is refused")
}

/// Does some work that may panic, and uses nothing afterwards that it has touched.
fn guarded<T>(work: impl FnOnce() -> anyhow::Result<T>) -> anyhow::Result<T> {
    let outcome = panic::catch_unwind(AssertUnwindSafe(work));
    outcome.unwrap_or_else(|_| bail!("the engine panicked; standard error has its message"))
}

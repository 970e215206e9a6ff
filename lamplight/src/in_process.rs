//! Runs by the in-process engine: one for `run`, many for `batch`, `shrink` and `fuzz`.

use std::{
    panic::{self, AssertUnwindSafe},
    sync::Arc,
};

use anyhow::bail;
use arena::Arena;
use arena_daemon::{
    engine::{self, Observer, Plan},
    live::Live,
    outputs::Outputs,
    pace::Overload,
    progress::Audience,
    squad::in_process::InProcess,
    stop::StopFlag,
    summary::Summary,
    trial::{self, Record},
};
use coverage::{CoverageController, setup::CoverageSetup};
use protocol::{robot_id::RobotId, setup::Mode};
use scenario::Scenario;

/// How a run goes by.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pace {
    /// Cap on virtual over real time.
    pub(crate) speed: Option<f64>,
    /// Whether the arena may use all cores.
    pub(crate) shares: bool,
    /// Destination of progress reports.
    pub(crate) audience: Audience,
}

/// Runs `scenario`, whose start `arena` is, to its end in this process, with `live` for those who watch.
pub(crate) fn run(
    scenario: &Scenario,
    arena: &mut Arena,
    Pace { speed, shares, audience }: Pace,
    outputs: Outputs,
    stop: &StopFlag,
    observer: &mut Observer<'_>,
    live: Option<Arc<Live>>,
) -> Summary {
    let mode = Mode::Lockstep;
    let mut squad = squad(scenario).watched(live);
    let plan = Plan { engine: "in-process", mode, speed, overload: Overload::Report, shares, audience };
    engine::run(scenario, arena, &mut squad, plan, outputs, stop, observer)
}

/// The same as fast as it can, silently and without outputs: one run of many. A panic ends this run alone.
pub(crate) fn run_quietly(
    scenario: &Scenario,
    stop: &StopFlag,
    observer: &mut Observer<'_>,
) -> anyhow::Result<Summary> {
    guarded(|| {
        let (mut arena, outputs) = (Arena::new(scenario)?, Outputs::begin(None, scenario)?);
        let pace = Pace { speed: None, shares: false, audience: Audience::Nobody };
        Ok(run(scenario, &mut arena, pace, outputs, stop, observer, None))
    })
}

/// Plays one trial of a batch. A panic ends this trial alone.
pub(crate) fn trial(scenario: &Scenario, stop: &StopFlag) -> anyhow::Result<Record> {
    guarded(|| trial::play(scenario, &mut squad(scenario), "in-process", stop))
}

/// Way out for scenarios in which programs think for robots.
pub(crate) const INSTEAD: &str = "use `lamplight run --engine processes`, or link the crate `engine` and hand it a constructor of \
     your controller";

/// The paper's controller for every robot of `scenario`, in which no programs are.
fn squad(scenario: &Scenario) -> InProcess<CoverageController, impl Fn(RobotId) -> CoverageController> {
    let setup = |robot| scenario.coverage_setup(robot).expect("programs were refused");
    let setups: Vec<CoverageSetup> = (0..scenario.robot_count()).map(setup).collect();
    InProcess::new(scenario.robot_count(), move |id| CoverageController::new(id, setups[id.index as usize]))
}

/// Does some work that may panic, and uses nothing afterwards that it has touched.
fn guarded<T>(work: impl FnOnce() -> anyhow::Result<T>) -> anyhow::Result<T> {
    let outcome = panic::catch_unwind(AssertUnwindSafe(work));
    outcome.unwrap_or_else(|_| bail!("the engine panicked; standard error has its message"))
}

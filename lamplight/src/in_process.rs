//! Runs by the in-process engine: one for `run`, many for `batch`, `shrink` and `fuzz`.

use std::{
    ops::Range,
    panic::{self, AssertUnwindSafe},
    sync::OnceLock,
};

use anyhow::bail;
use arena::Arena;

use coverage::CoverageController;
use engine::{InProcess, Observer, Plan, StopFlag, summary::Summary};
use observe::{
    recovery::Recovery,
    trial::{self, Record},
};
use protocol::{controller::Controller, params::Params, robot_id::RobotId};
use scenario::{PythonSpec, RobotSet, Scenario, ScenarioError};
use squad::{Squad, SquadError};
use tracing::subscriber::NoSubscriber;

use crate::python;

/// Runs `scenario` as fast as it can, without outputs and a word to the log, as one run of many, told to `observers`. A panic
/// ends this run alone.
pub(crate) fn run_quietly(
    scenario: &Scenario,
    stop: &StopFlag,
    observers: Vec<&mut dyn Observer>,
) -> anyhow::Result<Summary> {
    let run = || {
        let (mut arena, mut squad) = (Arena::new(scenario)?, squad(scenario)?);
        let mut recovery = Recovery::new(scenario);
        let mut all: Vec<&mut dyn Observer> = vec![&mut recovery];
        all.extend(observers.into_iter().map(|observer| observer as &mut dyn Observer));
        let plan = Plan { shares: false, ..Plan::IN_PROCESS };
        Ok(engine::play(scenario, &mut arena, &mut *squad, plan, &mut all, stop))
    };
    // Its summary says what was wrong with it.
    guarded(|| tracing::subscriber::with_default(NoSubscriber::default(), run))
}

/// Plays one trial of a batch. A panic ends this trial alone.
pub(crate) fn trial(scenario: &Scenario, stop: &StopFlag) -> anyhow::Result<Record> {
    guarded(|| trial::play(scenario, &mut *squad(scenario)?, "in-process", stop))
}

/// Way out for scenarios in which programs think for robots.
pub(crate) const INSTEAD: &str = "this plays robots in one process, without programs; `lamplight run --engine processes` plays them, and \
     so does the crate `engine` with a constructor of your controller";

/// Makes controllers in Python: an interpreter, in which this process runs.
pub trait PythonHost: Send + Sync {
    /// Makes what makes the controllers of this class.
    ///
    /// # Errors
    /// If there is no such class.
    fn constructor(&self, python: &PythonSpec) -> Result<Box<PythonConstructor>, String>;
}

/// Makes the controller of one life of a robot of its parameters, or says why it refuses them.
pub type PythonConstructor = dyn Fn(RobotId, &Params) -> Result<Box<dyn Controller>, String>;

static PYTHON: OnceLock<Box<dyn PythonHost>> = OnceLock::new();

/// From here on controllers in Python are made by `python`.
pub(crate) fn host(python: Option<Box<dyn PythonHost>>) {
    if let Some(python) = python {
        // A process has one interpreter.
        let _ = PYTHON.set(python);
    }
}

/// Makes sure that the controllers of `scenario` can be played in this process. Where some are in Python and this process
/// is none, it becomes one, and begins anew.
pub(crate) fn prepare(scenario: &mut Scenario, instead: &str) -> Result<(), ScenarioError> {
    scenario.refuse_programs(true, instead)?;
    scenario.find_controllers()?;
    let Some(controller) = scenario.controllers.iter().find(|controller| controller.python().is_some())
    else {
        return Ok(());
    };
    match PYTHON.get() {
        Some(_) => Ok(()),
        None => Err(controller.error(
            format!("a Python interpreter cannot be started: {}", python::become_interpreter()),
            "name one that has the package lamplight by LAMPLIGHT_PYTHON",
        )),
    }
}

/// Whether the controllers of `scenario` can be played in this process: no program thinks for a robot.
pub(crate) fn can_play(scenario: &Scenario) -> bool {
    scenario.refuse_programs(true, INSTEAD).is_ok()
}

/// A controller for every robot of `scenario`, which has been [prepared](prepare).
pub(crate) fn squad(scenario: &Scenario) -> Result<Box<dyn Squad>, SquadError> {
    squad_of(scenario, 0..scenario.robot_count())
}

/// A controller for each of these robots alone.
pub(crate) fn squad_of(scenario: &Scenario, robots: Range<u32>) -> Result<Box<dyn Squad>, SquadError> {
    let everyone = 0..scenario.robot_count();
    if let Some(setups) = everyone.map(|robot| scenario.coverage_setup(robot)).collect::<Option<Vec<_>>>() {
        let new = move |id: RobotId| Ok(CoverageController::new(id, setups[id.index as usize]));
        return Ok(Box::new(InProcess::new(scenario, robots, new)));
    }
    let entries: Vec<_> = scenario
        .controllers
        .iter()
        .map(|controller| {
            let new: Box<PythonConstructor> = match controller.python() {
                Some(python) => python_host().constructor(python).map_err(SquadError)?,
                None => Box::new(|id, params| {
                    let setup = params.decode().map_err(|error| error.to_string())?;
                    Ok(Box::new(CoverageController::new(id, setup)))
                }),
            };
            Ok((controller.robots.clone(), scenario.params(controller), new))
        })
        .collect::<Result<_, SquadError>>()?;
    let new = move |id: RobotId| {
        let is_theirs =
            |(robots, ..): &&(RobotSet, Params, Box<PythonConstructor>)| robots.contains(id.index);
        let (_, params, new) = entries.iter().find(is_theirs).expect("every robot has a controller");
        new(id, params).map_err(|why| SquadError(format!("it refuses its params: {why}")))
    };
    Ok(Box::new(InProcess::new(scenario, robots, new)))
}

fn python_host() -> &'static dyn PythonHost {
    &**PYTHON.get().expect("whoever plays a scenario has prepared it")
}

/// Does some work that may panic, and uses nothing afterwards that it has touched.
fn guarded<T>(work: impl FnOnce() -> anyhow::Result<T>) -> anyhow::Result<T> {
    let outcome = panic::catch_unwind(AssertUnwindSafe(work));
    outcome.unwrap_or_else(|_| bail!("the engine panicked; standard error has its message"))
}

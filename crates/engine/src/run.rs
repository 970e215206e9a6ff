//! A whole run in this process, with controllers of one's own.

use std::fmt;

use arena::{Arena, placement::PlacementError};
use protocol::{controller::Controller, params::Params, robot_id::RobotId};
use scenario::Scenario;
use squad::{SquadError, stop::StopFlag};

use crate::{
    in_process::InProcess,
    observer::Observer,
    play::{Plan, play},
    summary::Summary,
};

/// Makes the controller of one life of a robot of its parameters, or says why it refuses them.
pub type NewController<'a> = dyn Fn(RobotId, &Params) -> Result<Box<dyn Controller>, SquadError> + 'a;

/// Why a run cannot begin. One that fails later says so in its summary.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The arena has no room for the robots.
    #[error(transparent)]
    Placement(#[from] PlacementError),
    /// There are more or fewer constructors than controllers in the scenario.
    #[error(
        "the scenario has {wanted} controllers, and there are {given} constructors; give one for each [[controller]]"
    )]
    Controllers {
        /// Entries of the scenario.
        wanted: usize,
        /// Constructors that were given.
        given: usize,
    },
}

/// Makes a constructor of one that [`run`] takes: what is given to `robot_agent::main` will do.
pub fn controller<C: Controller + 'static, E: fmt::Display>(
    new: impl Fn(RobotId, &Params) -> Result<C, E>,
) -> impl Fn(RobotId, &Params) -> Result<Box<dyn Controller>, SquadError> {
    move |robot, params| match new(robot, params) {
        Ok(controller) => Ok(Box::new(controller)),
        Err(error) => Err(SquadError(format!("the controller of {robot} refuses its parameters: {error}"))),
    }
}

/// Runs `scenario` in this process to its end, as fast as it can. `controllers` has a constructor for each
/// `[[controller]]` of the scenario, in their order, which stands in for its program: so the scenario is the same for
/// processes, and so is the digest.
///
/// # Errors
/// If the run cannot begin.
pub fn run(
    scenario: &Scenario,
    controllers: &[&NewController<'_>],
    observers: &mut [&mut dyn Observer],
) -> Result<Summary, RunError> {
    let entries = &scenario.controllers;
    if entries.len() != controllers.len() {
        return Err(RunError::Controllers { wanted: entries.len(), given: controllers.len() });
    }
    let params: Vec<Params> = entries.iter().map(|entry| scenario.params(entry)).collect();
    let new = |robot: RobotId| {
        let of_robot = |at: &usize| entries[*at].robots.contains(robot.index);
        let entry = (0..entries.len()).find(of_robot).expect("every robot has a controller");
        controllers[entry](robot, &params[entry])
    };
    let mut arena = Arena::new(scenario)?;
    let mut squad = InProcess::new(scenario, 0..scenario.robot_count(), new);
    Ok(play(scenario, &mut arena, &mut squad, Plan::IN_PROCESS, observers, &StopFlag::default()))
}

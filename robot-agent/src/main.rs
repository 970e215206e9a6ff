//! One robot of the paper, as a process: hear its neighbors, sense the light, steer to the centroid of its cell.

#![forbid(unsafe_code)]

use std::process::ExitCode;

use coverage::CoverageController;

fn main() -> ExitCode {
    robot_agent::main(|robot, params| params.decode().map(|setup| CoverageController::new(robot, setup)))
}

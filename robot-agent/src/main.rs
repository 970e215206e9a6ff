//! One robot of the paper, as a process: hear its neighbors, sense the light, steer to the centroid of its cell.

#![forbid(unsafe_code)]

use std::process::ExitCode;

use coverage::CoverageController;

fn main() -> ExitCode {
    // Boxed, it is made where it stays: moved, it would touch all the memory that it has room for.
    robot_agent::main(|robot, params| match params.decode() {
        Ok(setup) => Ok(Box::new(CoverageController::new(robot, setup))),
        Err(error) => Err(format!(
            "they are of no law, and this program has no other: give `law` in place of `program` ({error})"
        )),
    })
}

//! The controller as a process: one robot of a run.

use std::process::ExitCode;

fn main() -> ExitCode {
    robot_agent::main(rust_controller::new)
}

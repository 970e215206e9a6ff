//! The same scenario without processes: `in-process mixed.toml` plays it here, and ends with the same digest.

use std::{env, error::Error, path::Path, process::ExitCode};

use coverage::CoverageController;
use scenario::Scenario;

fn main() -> ExitCode {
    match play() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

fn play() -> Result<(), Box<dyn Error>> {
    let file = env::args_os().nth(1).ok_or("usage: in-process SCENARIO")?;
    let scenario = Scenario::load(Path::new(&file), &[])?;
    // One constructor for each [[controller]], in the order of the file.
    let paper = engine::controller(|robot, params| {
        params.decode().map(|setup| CoverageController::new(robot, setup))
    });
    let ours = engine::controller(rust_controller::new);
    let summary = engine::run(&scenario, &[&paper, &ours], &mut [])?;
    print!("{}", summary.json());
    Ok(())
}

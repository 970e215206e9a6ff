//! An observer of one's own: how far each robot drives. See README.md beside it.

use std::{env, error::Error, path::Path, process::ExitCode};

use arena::frame::Pose;
use coverage::CoverageController;
use engine::{Observer, ObserverError, TickView, summary::Summary};
use scenario::Scenario;

/// Adds up how far each robot drives.
#[derive(Default)]
struct Distances {
    last: Vec<Pose>,
    driven_m: Vec<f64>,
}

impl Observer for Distances {
    fn ticked(&mut self, tick: &TickView<'_>) -> Result<(), ObserverError> {
        self.driven_m.resize(tick.poses().len(), 0.0);
        for ((driven_m, last), pose) in self.driven_m.iter_mut().zip(&self.last).zip(tick.poses()) {
            *driven_m += (pose.position - last.position).norm();
        }
        self.last = tick.poses().to_vec();
        Ok(())
    }

    fn finished(&mut self, _: &TickView<'_>, summary: &Summary) -> Result<(), ObserverError> {
        println!("robot,driven_m");
        for (robot, driven_m) in self.driven_m.iter().enumerate() {
            println!("{robot},{driven_m}");
        }
        eprintln!("{} ticks, digest {}", summary.ticks, summary.digest);
        Ok(())
    }
}

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
    let file = env::args_os().nth(1).ok_or("usage: custom-observer SCENARIO")?;
    let scenario = Scenario::load(Path::new(&file), &[])?;
    let paper = engine::controller(|robot, params| {
        params.decode().map(|setup| CoverageController::new(robot, setup))
    });
    engine::run(&scenario, &[&paper], &mut [&mut Distances::default()])?;
    Ok(())
}

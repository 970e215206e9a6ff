//! Local cells against global ones, as the paper has it: how often they agree depends on how many robots there are.

#![allow(clippy::unwrap_used, reason = "these are tests, helpers included")]

use arena::{Arena, metrics::Attendance};
use coverage::CoverageController;
use protocol::{controller::Hosted, robot_id::RobotId};
use scenario::{Override, Scenario};
use tests::programs;

const SEEDS: u64 = 150;

/// The share of local cells that agree with the global ones at the start of a run.
fn agreement(robots: u32, seed: u64) -> f64 {
    let sets = ["robots.radius_m=0", "duration_s=0.1"].map(str::to_owned);
    let sets = sets.into_iter().chain([format!("robots.count={robots}"), format!("seed={seed}")]);
    let sets: Vec<Override> = sets.map(|set| set.parse().unwrap()).collect();
    let scenario = Scenario::load(&programs::scenario("swarmbots"), &sets).unwrap();
    let setup = scenario.coverage_setup(0).unwrap();
    let mut minds: Vec<_> = (0..robots)
        .map(RobotId::first)
        .map(|id| Hosted::new(id, CoverageController::new(id, setup)))
        .collect();
    let mut arena = Arena::new(&scenario).unwrap();
    let boots: Vec<_> = minds.iter_mut().map(|mind| Some(mind.boot())).collect();
    let percepts = arena.tick(&boots).unwrap();
    let answers: Vec<_> =
        minds.iter_mut().zip(percepts).map(|(mind, percept)| Some(mind.step(percept, &mut ()))).collect();
    arena.metrics(&answers, Attendance::default()).cell_agreement.unwrap()
}

#[test]
fn local_cells_agree_with_global_ones_as_often_as_the_guide_says() {
    for (robots, expected) in [(10, 0.371), (20, 0.725), (40, 0.962), (50, 0.987), (100, 1.0)] {
        let mean = (1..=SEEDS).map(|seed| agreement(robots, seed)).sum::<f64>() / SEEDS as f64;
        println!("{robots} robots: {mean:.4}");
        assert!((mean - expected).abs() <= 6e-4, "{robots} robots: {mean}, the guide says {expected}");
    }
}

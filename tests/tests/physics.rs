//! Section V with an ideal channel against independent reference results.

#![allow(clippy::unwrap_used, reason = "these are tests, helpers included")]

use arena::{
    Arena,
    metrics::mean_lamp_distance,
    scenario::{Override, Scenario},
};
use coverage::Controller;
use protocol::{robot_id::RobotId, setup::Mode};
use tests::programs;

const SEEDS: u64 = 20;

/// Offset Φ, and the mean distance to the middle of the lamps after 120 s, meters (40 seeds of an
/// independent implementation, standard deviation .011 to .002).
const REFERENCE: [(f64, f64); 4] = [(1600.0, 1.386), (400.0, 1.058), (100.0, 0.753), (10.0, 0.652)];

/// Mean over seeds of the final mean distance to the lamps.
fn mean_distance(offset: f64, drive: &str) -> f64 {
    let total: f64 = (1..=SEEDS).map(|seed| final_distance(offset, drive, seed)).sum();
    total / SEEDS as f64
}

fn final_distance(offset: f64, drive: &str, seed: u64) -> f64 {
    let sets = [format!("field.offset={offset}"), format!("robots.drive={drive}"), format!("seed={seed}")];
    let sets: Vec<Override> = sets.iter().map(|set| set.parse().unwrap()).collect();
    let scenario = Scenario::load(&programs::scenario("swarmbots"), &sets).unwrap();
    let setup = scenario.agent_setup(Mode::Lockstep).controller;
    let mut minds: Vec<_> =
        (0..scenario.robot_count()).map(|index| Controller::new(RobotId::first(index), setup)).collect();
    let mut arena = Arena::new(&scenario).unwrap();
    let mut commands: Vec<_> = minds.iter_mut().map(|mind| Some(mind.boot())).collect();
    for _ in 0..=scenario.ticks() {
        let percepts = arena.tick(&commands);
        commands = minds.iter_mut().zip(percepts).map(|(mind, percept)| Some(mind.step(percept))).collect();
    }
    let positions: Vec<_> = arena.poses().iter().map(|pose| pose.position).collect();
    let lamps: Vec<_> = scenario.lamps().iter().map(|lamp| lamp.position_m.get().into()).collect();
    mean_lamp_distance(&positions, &lamps).unwrap()
}

#[test]
fn robots_gather_around_the_lamps_as_closely_as_the_offset_says() {
    println!("| Φ | reference, m | holonomic, m | differential drive, m |");
    println!("|---|---|---|---|");
    for (offset, reference) in REFERENCE {
        let (holonomic, differential) =
            (mean_distance(offset, "holonomic"), mean_distance(offset, "differential"));
        println!("| {offset} | {reference:.3} | {holonomic:.3} | {differential:.3} |");
        assert!((holonomic / reference - 1.0).abs() < 0.03, "Φ = {offset}: {holonomic} m");
        // Turning takes time and nothing else: the same places, a little later.
        assert!((differential / reference - 1.0).abs() < 0.1, "Φ = {offset}: {differential} m on wheels");
    }
}

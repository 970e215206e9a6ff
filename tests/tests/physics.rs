//! Section V against independent reference results, with an ideal channel and with a real one.

#![allow(clippy::unwrap_used, reason = "these are tests, helpers included")]

use arena::{
    Arena,
    metrics::{Attendance, Metrics},
};
use coverage::CoverageController;
use protocol::{controller::Hosted, robot_id::RobotId};
use scenario::{Override, Scenario};
use tests::programs;

const SEEDS: u64 = 20;

/// Offset Φ, and the mean distance to the middle of the lamps after 120 s, meters (40 seeds of an
/// independent implementation, standard deviation .011 to .002).
const REFERENCE: [(f64, f64); 4] = [(1600.0, 1.386), (400.0, 1.058), (100.0, 0.753), (10.0, 0.652)];

/// Mean over seeds of the final mean distance to the lamps.
fn mean_distance(sets: &[&str]) -> f64 {
    let distance = |seed| final_state("swarmbots", sets, seed).mean_lamp_distance_m.unwrap();
    (1..=SEEDS).map(distance).sum::<f64>() / SEEDS as f64
}

/// How a scenario with these settings ends.
fn final_state(scenario: &str, sets: &[&str], seed: u64) -> Metrics {
    play(scenario, sets, seed, |_, _| {})
}

/// Plays a scenario with these settings; `look` sees each second, and how it ends is returned.
fn play(scenario: &str, sets: &[&str], seed: u64, mut look: impl FnMut(f64, &Metrics)) -> Metrics {
    let seed = format!("seed={seed}");
    let sets = sets.iter().copied().chain([seed.as_str()]);
    let sets: Vec<Override> = sets.map(|set| set.parse().unwrap()).collect();
    let scenario = Scenario::load(&programs::scenario(scenario), &sets).unwrap();
    let setup = scenario.coverage_setup(0).unwrap();
    let mut minds: Vec<_> = (0..scenario.robot_count())
        .map(RobotId::first)
        .map(|id| Hosted::new(id, CoverageController::new(id, setup)))
        .collect();
    let mut arena = Arena::new(&scenario).unwrap();
    let mut commands: Vec<_> = minds.iter_mut().map(|mind| Some(mind.boot())).collect();
    for tick in 0..=scenario.ticks() {
        if let Some(percepts) = arena.tick(&commands) {
            commands = minds
                .iter_mut()
                .zip(percepts)
                .map(|(mind, percept)| Some(mind.step(percept, &mut ())))
                .collect();
        }
        if tick.is_multiple_of(scenario.sample_every_ticks()) {
            look(arena.time_s(), &arena.metrics(&commands, Attendance::default()));
        }
    }
    arena.metrics(&commands, Attendance::default())
}

#[test]
fn robots_gather_around_the_lamps_as_closely_as_the_offset_says() {
    println!("| Φ | reference, m | holonomic, m | differential drive, m |");
    println!("|---|---|---|---|");
    for (offset, reference) in REFERENCE {
        let offset_set = format!("field.offset={offset}");
        let distance = |drive: &str| mean_distance(&[&offset_set, &format!("robots.drive={drive}")]);
        let (holonomic, differential) = (distance("holonomic"), distance("differential"));
        println!("| {offset} | {reference:.3} | {holonomic:.3} | {differential:.3} |");
        assert!((holonomic / reference - 1.0).abs() < 0.03, "Φ = {offset}: {holonomic} m");
        // Turning takes time and nothing else: the same places, a little later.
        assert!((differential / reference - 1.0).abs() < 0.1, "Φ = {offset}: {differential} m on wheels");
    }
}

/// Noise and collisions spread the swarm a little, and change nothing about the order.
#[test]
fn on_the_infrared_of_the_swarmbots_a_smaller_offset_still_packs_them_closer() {
    println!("| Φ | isis, m |");
    println!("|---|---|");
    let mut last = f64::INFINITY;
    for offset in [1600, 800, 400, 200, 100, 50, 10] {
        let offset_set = format!("field.offset={offset}");
        let isis = mean_distance(&[&offset_set, "channel.profile=isis", "controller.cell_cap_m=1"]);
        println!("| {offset} | {isis:.3} |");
        assert!(isis < last, "Φ = {offset}: {isis} m, the next larger offset gave {last} m");
        last = isis;
    }
}

/// Mean cost H between 40 and 60 s of Section V on the SwarmBots' infrared, and its standard error, over 8 seeds.
fn late_cost_h(sets: &[&str]) -> (f64, f64) {
    const RUNS: u64 = 8;
    let isis = ["channel.profile=isis", "controller.cell_cap_m=1", "duration_s=60"];
    let sets = [&isis[..], sets].concat();
    let late = |seed| {
        let mut costs = Vec::new();
        play("swarmbots", &sets, seed, |time_s, metrics| {
            costs.extend(metrics.cost_h.filter(|_| time_s > 40.0));
        });
        costs.iter().sum::<f64>() / costs.len() as f64
    };
    let costs: Vec<f64> = (1..=RUNS).map(late).collect();
    let mean = costs.iter().sum::<f64>() / RUNS as f64;
    let squares: f64 = costs.iter().map(|cost| (cost - mean) * (cost - mean)).sum();
    (mean, (squares / (RUNS * (RUNS - 1)) as f64).sqrt())
}

#[test]
fn on_wheels_robots_cover_as_well_as_holonomic_ones_by_odometry_and_worse_without() {
    println!("| body | mean cost H from 40 to 60 s |");
    println!("|---|---|");
    let wheels = |odometry| late_cost_h(&["robots.drive=differential", odometry]);
    let costs = [late_cost_h(&[]), wheels("sensors.odometry=true"), wheels("sensors.odometry=false")];
    for (body, (mean, error)) in ["holonomic", "wheels", "wheels without odometry"].iter().zip(costs) {
        println!("| {body} | {mean:.1} ± {error:.1} |");
    }
    let [holonomic, wheels, blind] = costs;
    // How many standard errors of the difference the first is above the second.
    let above = |a: (f64, f64), b: (f64, f64)| (a.0 - b.0) / (a.1 * a.1 + b.1 * b.1).sqrt();
    assert!(above(wheels, holonomic).abs() < 2.0, "{}", above(wheels, holonomic));
    assert!(above(blind, wheels) > 3.0, "{}", above(blind, wheels));
}

/// Where few robots disturb each other and measure exactly, the infrared of the SwarmBots leads to the very
/// configurations that the ideal channel leads to.
#[test]
fn without_noise_and_in_a_sparse_swarm_collisions_only_cost_time() {
    let sparse = ["robots.count=5", "controller.gain_per_s=1", "step_s=0.05", "duration_s=600"];
    let exact = ["channel.profile=isis", "channel.sigma_range=0", "channel.sigma_bearing_deg=0"];
    // So patient that no row of misses makes a robot forget a neighbor: .16^16 per link and cycle.
    let exact = [&exact[..], &["controller.neighbor_timeout_cycles=16"]].concat();
    let ends = |sets: &[&str]| -> Vec<f64> {
        (1..=8).map(|seed| final_state("one-gaussian", sets, seed).cost_h.unwrap()).collect()
    };
    let ideal = ends(&sparse);
    let isis = ends(&[&sparse[..], &exact].concat());
    println!("H, ideal: {ideal:?}\nH, isis:  {isis:?}");
    for (ideal, isis) in ideal.iter().zip(&isis) {
        assert!((isis / ideal - 1.0).abs() < 1e-9, "{isis} is not {ideal}");
    }
}

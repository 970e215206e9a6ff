//! Odometry: what robots that turn know of those they heard before, and what they do not learn by it.

#![allow(clippy::unwrap_used, reason = "these are tests, helpers included")]

use arena::Arena;
use coverage::CoverageController;
use protocol::{
    command::{Answer, Command},
    controller::Hosted,
    frame::BodyVector,
    odometry::Odometry,
    percept::Tick,
    robot_id::RobotId,
    units::wrapped,
};
use scenario::Scenario;

fn scenario(text: &str) -> Scenario {
    Scenario::parse("odometry", text, &[]).unwrap_or_else(|error| panic!("{error}"))
}

/// Four robots and robot 0 among them, which hears them by a timed channel without noise.
fn in_circles(sets: &str) -> Scenario {
    scenario(&format!(
        "duration_s = 20.0
         step_s = 0.05
         arena.size_m = [4.0, 4.0]
         robots = {{ positions_m = [[2.0, 2.0], [1.5, 1.5], [2.5, 1.5], [2.5, 2.5], [1.5, 2.5]], drive = \"differential\" }}
         controller = {{ law = \"uniform\", gain_per_s = 1.0 }}
         channel = {{ profile = \"isis\", sigma_range = 0.0, sigma_bearing_deg = 0.0 }}
         {sets}"
    ))
}

/// Plays a scenario in which robot 0 turns to its left at `speed_m_per_s`, whatever it thinks, and the others stand
/// still. `look` is told by how much robot 0's bearing of each robot that it knows is off, radians, cycle by cycle.
fn play(scenario: &Scenario, speed_m_per_s: f64, mut look: impl FnMut(Tick, f64)) {
    let setup = scenario.coverage_setup(0).unwrap();
    let new = |index| {
        let id = RobotId::first(index);
        Hosted::new(id, CoverageController::new(id, setup))
    };
    let mut robots: Vec<_> = (0..scenario.robot_count()).map(new).collect();
    let mut commands: Vec<_> = robots.iter_mut().map(|robot| Some(robot.boot())).collect();
    let mut arena = Arena::new(scenario).unwrap();
    for tick in 0..=scenario.ticks() {
        arena.process_faults(&[]);
        let Some(percepts) = arena.tick(&commands) else { continue };
        for ((robot, percept), command) in robots.iter_mut().zip(percepts).zip(&mut commands) {
            let answer = command.insert(robot.step(percept, &mut ()));
            answer.command.velocity = BodyVector::HERE;
        }
        commands[0].as_mut().unwrap().command.velocity = BodyVector::new(0.0, speed_m_per_s);
        let poses = arena.poses();
        for known in robots[0].controller.neighbors().iter() {
            let sender = poses[known.delivery.packet.sender().index as usize].position;
            look(tick, wrapped(known.delivery.bearing.get() - poses[0].sees(sender).bearing()));
        }
    }
}

/// By how much robot 0's bearings of its neighbors are off in a run: mean, and the worst, degrees.
fn bearings_off(scenario: &Scenario) -> (f64, f64) {
    let (mut sum, mut worst, mut count) = (0.0, 0.0_f64, 0);
    play(scenario, 0.1, |_, off| {
        let off = off.abs().to_degrees();
        (sum, worst, count) = (sum + off, worst.max(off), count + 1);
    });
    assert!(count > 200, "{count}");
    (sum / f64::from(count), worst)
}

#[test]
fn robots_that_turn_know_where_they_heard_their_neighbors_by_odometry() {
    let (mean, worst) = bearings_off(&in_circles(""));
    assert!(worst < 1e-9, "off by {mean} degrees, at most {worst}");
    let (mean, _) = bearings_off(&in_circles("sensors.odometry = false"));
    println!("without odometry off by {mean} degrees on average");
    assert!(mean > 20.0, "without odometry off by {mean} degrees only");
    let (mean, _) = bearings_off(&in_circles("sensors.odometry_error = 0.1"));
    println!("with an error of 0.1 off by {mean} degrees on average");
    assert!((0.1..10.0).contains(&mean), "with an error of 0.1 off by {mean} degrees");
}

#[test]
fn a_delayed_packet_is_carried_along_from_its_arrival() {
    // Robot 0 turns .3 rad per tick and hardly moves; what it hears comes five ticks late.
    let scenario = scenario(
        "duration_s = 2.0
         step_s = 0.1
         arena.size_m = [4.0, 4.0]
         robots = { positions_m = [[2.0, 2.0], [2.5, 2.5]], drive = \"differential\" }
         controller = { law = \"uniform\", gain_per_s = 1.0, neighbor_timeout_cycles = 8 }
         channel = { range_m = 2.0, cycle_s = 0.3 }
         fault = [{ kind = \"delay\", delay_s = 0.5, until_s = 1.05 }]",
    );
    let mut seen = 0;
    play(&scenario, 1e-9, |tick, off| {
        // The last that is late was sent in tick 10; what comes in time then is exact.
        let expected = if tick <= 9 { 5.0 * 0.3 } else { 0.0 };
        assert!((off - expected).abs() < 1e-8, "tick {tick}: {off}");
        seen += 1;
    });
    assert_eq!(seen, 5);
}

#[test]
fn odometry_says_nothing_of_the_arena_and_begins_anew_with_each_life() {
    // The same motion from two places, under two headings; robot 1 is dead in tick 9 and begins a new life in tick 10.
    let scenario = scenario(
        "duration_s = 2.0
         step_s = 0.1
         arena.size_m = [20.0, 20.0]
         robots = { positions_m = [[5.0, 5.0], [15.0, 12.0]], headings_rad = [0.0, 2.0], drive = \"differential\" }
         controller = { law = \"uniform\", gain_per_s = 1.0 }
         channel.range_m = 1.0
         fault = [{ kind = \"kill\", robots = \"1\", at_s = 0.9, restart_at_s = 1.0 }]",
    );
    let mut arena = Arena::new(&scenario).unwrap();
    let mut lives = [RobotId::first(0), RobotId::first(1)];
    let mut readings = Vec::new();
    for tick in 0..=scenario.ticks() {
        arena.process_faults(&[]);
        if tick == 10 {
            lives[1] = lives[1].reborn();
        }
        let turning = |id| {
            let velocity = if tick == 10 { BodyVector::HERE } else { BodyVector::new(0.1, 0.2) };
            Some(Answer { sender: id, sequence: 0, command: Command { velocity, ..Command::REST } })
        };
        let mut commands = lives.map(turning);
        if tick == 9 {
            commands[1] = None;
        }
        let percepts = arena.tick(&commands).unwrap();
        readings.push([0, 1].map(|robot: usize| percepts[robot].odometry.unwrap()));
    }
    let same = |[a, b]: [Odometry; 2]| {
        (a.position.0 - b.position.0).norm() < 1e-12
            && wrapped(a.heading.get() - b.heading.get()).abs() < 1e-12
    };
    assert_eq!(readings[0], [Odometry::default(); 2]);
    assert!(readings[..9].iter().all(|&both| same(both)), "{readings:?}");
    assert!(readings[8][0].position.length() > 0.01);
    assert_eq!(readings[10][1], Odometry::default());
    assert!(readings[10][0].position.length() > 0.01);
    assert!(same([readings[1][0], readings[11][1]]), "the new life's first step is like the old one's");
}

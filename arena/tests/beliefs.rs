//! Beliefs of robots of each other, as packets come late or out of order.

#![allow(clippy::unwrap_used, reason = "these are tests, helpers included")]

use arena::{Arena, scenario::Scenario};
use coverage::controller::Controller;
use protocol::{
    command::Command, frame::BodyVector, odometry::Odometry, percept::Tick, robot_id::RobotId, setup::Mode,
    units::wrapped,
};

fn scenario(text: &str) -> Scenario {
    Scenario::parse("beliefs", text, &[]).unwrap_or_else(|error| panic!("{error}"))
}

/// Plays a scenario with the true controllers; `look` sees each tick.
fn play(scenario: &Scenario, ticks: Tick, mut look: impl FnMut(&Arena, &[Option<Command>], &[Controller])) {
    let setup = scenario.agent_setup(Mode::Lockstep).controller;
    let new = |index| Controller::new(RobotId::first(index), setup);
    let mut controllers: Vec<Controller> = (0..scenario.robot_count()).map(new).collect();
    let mut commands: Vec<_> = controllers.iter_mut().map(|controller| Some(controller.boot())).collect();
    let mut arena = Arena::new(scenario).unwrap();
    for _ in 0..=ticks {
        arena.strikes(&[]);
        if let Some(percepts) = arena.tick(&commands) {
            let answers =
                controllers.iter_mut().zip(percepts).map(|(mind, percept)| Some(mind.step(percept)));
            commands = answers.collect();
        }
        look(&arena, &commands, &controllers);
    }
}

#[test]
fn overtaken_packets_are_not_believed_though_their_sender_was_forgotten_meanwhile() {
    // Robot 1 moves away at 0.1 m/s, and its packets overtake each other: an old belief is a shorter range.
    let scenario = scenario(
        "duration_s = 60.0
         step_s = 0.1
         arena.size_m = [20.0, 20.0]
         robots = { positions_m = [[5.0, 5.0], [6.0, 5.0]], headings_rad = [0.0, 0.0] }
         controller = { law = \"uniform\", gain_per_s = 1e-4 }
         channel.range_m = 15.0
         fault = [{ kind = \"motion\", robots = \"1\", drift_m_per_s = [0.1, 0.0] },
                  { kind = \"delay\", links = [\"1->0\"], delay_s = 0.5, jitter_s = 1.0 }]",
    );
    let (mut last, mut beliefs, mut back) = ((0, 0.0), 0, 0);
    play(&scenario, 600, |_, _, controllers| {
        for known in controllers[0].neighbors().iter() {
            let now = (known.delivery.packet.sequence, known.delivery.range.get());
            beliefs += 1;
            back += u32::from(now < last || now.1 < last.1);
            last = now;
        }
    });
    assert_eq!(back, 0, "beliefs of {beliefs} that step back in time");
    assert!(beliefs > 200, "{beliefs}");
}

/// Mean of `staleness_s` over what `counts` lets through, by tick.
fn mean_staleness_s(scenario: &Scenario, ticks: Tick, counts: impl Fn(Tick) -> bool) -> f64 {
    let (mut sum_s, mut count) = (0.0, 0);
    play(scenario, ticks, |arena, commands, _| {
        if let Some(age_s) = arena.metrics(commands).staleness_s.filter(|_| counts(arena.current_tick())) {
            sum_s += age_s;
            count += 1;
        }
    });
    assert!(count > 0, "nobody knows anybody");
    sum_s / f64::from(count)
}

#[test]
fn staleness_is_the_age_since_packets_were_sent() {
    let two = "arena.size_m = [4.0, 4.0]
         robots = { positions_m = [[1.0, 2.0], [1.5, 2.0]], speed_limit_m_per_s = 1e-9 }
         controller.law = \"uniform\"
         controller.gain_per_s = 1.0";
    // Packets start at random in cycles of 1 s, so at a cycle's start they are half a cycle old, and a whole one on
    // average over all times.
    let timed = scenario(&format!(
        "duration_s = 400.0
         step_s = 0.01
         {two}
         channel = {{ profile = \"isis\", access = \"aligned\", cycle_s = 1.0, half_duplex = false }}"
    ));
    let at_start = mean_staleness_s(&timed, 40_000, |tick| tick % 100 == 0);
    assert!((at_start - 0.5).abs() < 0.05, "{at_start}");
    let all = mean_staleness_s(&timed, 40_000, |_| true);
    assert!((all - 1.0).abs() < 0.05, "{all}");
    let late = scenario(&format!(
        "duration_s = 10.0
         step_s = 0.1
         {two}
         controller.neighbor_timeout_cycles = 40
         channel.range_m = 1.0
         fault = [{{ kind = \"delay\", delay_s = 2.0 }}]"
    ));
    let late = mean_staleness_s(&late, 100, |tick| tick >= 20);
    assert!((late - 2.0).abs() < 1e-9, "{late}");
}

/// Four robots that stand still, and robot 0 among them, which turns and drives in circles at 3 rad/s and hears them by a
/// timed channel without noise.
fn in_circles(sets: &str) -> Scenario {
    scenario(&format!(
        "duration_s = 20.0
         step_s = 0.05
         arena.size_m = [4.0, 4.0]
         robots = {{ positions_m = [[2.0, 2.0], [1.5, 1.5], [2.5, 1.5], [2.5, 2.5], [1.5, 2.5]], drive = \"differential\" }}
         controller = {{ law = \"uniform\", gain_per_s = 1.0 }}
         channel = {{ profile = \"isis\", sigma_range = 0.0, sigma_bearing_deg = 0.0 }}
         fault = [{{ kind = \"motion\", robots = \"1-4\", stuck = true }}]
         {sets}"
    ))
}

/// By how much robot 0's bearings of its neighbors are off at the percepts of a run: mean, and the worst, degrees.
fn bearings_off(scenario: &Scenario) -> (f64, f64) {
    let setup = scenario.agent_setup(Mode::Lockstep).controller;
    let mut minds: Vec<_> = (0..5).map(|index| Controller::new(RobotId::first(index), setup)).collect();
    let mut commands: Vec<_> = minds.iter_mut().map(|mind| Some(mind.boot())).collect();
    let mut arena = Arena::new(scenario).unwrap();
    let (mut sum, mut worst, mut count) = (0.0, 0.0_f64, 0);
    for _ in 0..=scenario.ticks() {
        arena.strikes(&[]);
        let Some(percepts) = arena.tick(&commands) else { continue };
        let answers = minds.iter_mut().zip(percepts).map(|(mind, percept)| Some(mind.step(percept)));
        commands = answers.collect();
        // It keeps turning to its left, whatever it thinks.
        commands[0].as_mut().unwrap().velocity = BodyVector::new(0.0, 0.1);
        let poses = arena.poses();
        for known in minds[0].neighbors().iter() {
            let sender = poses[known.delivery.packet.sender.index as usize].position;
            let off =
                wrapped(known.delivery.bearing.get() - poses[0].sees(sender).bearing()).abs().to_degrees();
            (sum, worst, count) = (sum + off, worst.max(off), count + 1);
        }
    }
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
    let setup = scenario.agent_setup(Mode::Lockstep).controller;
    let mut lives = [RobotId::first(0), RobotId::first(1)];
    let mut readings = Vec::new();
    for tick in 0..=scenario.ticks() {
        arena.strikes(&[]);
        if tick == 10 {
            lives[1] = lives[1].reborn();
        }
        let turning = |id| {
            let velocity = if tick == 10 { BodyVector::HERE } else { BodyVector::new(0.1, 0.2) };
            Some(Command { velocity, ..Controller::new(id, setup).boot() })
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

//! Beliefs of robots of each other, as packets come late or out of order.

#![allow(clippy::unwrap_used, reason = "these are tests, helpers included")]

use arena::{Arena, scenario::Scenario};
use coverage::controller::Controller;
use protocol::{command::Command, percept::Tick, robot_id::RobotId, setup::Mode};

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

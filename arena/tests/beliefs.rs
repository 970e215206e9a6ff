//! What robots believe of each other, as packets come late or out of order.

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
            let answers = controllers.iter_mut().zip(percepts).map(|(mind, percept)| Some(mind.step(percept)));
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

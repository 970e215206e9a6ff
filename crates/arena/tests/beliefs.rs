//! Beliefs of robots of each other, as packets come late or out of order.

#![allow(clippy::unwrap_used, reason = "these are tests, helpers included")]

use arena::{
    Arena,
    channel::{Channel, Moment},
    executor::Sequential,
    frame::{ArenaPoint, Pose},
    metrics::Attendance,
    packets::Packets,
};
use coverage::CoverageController;
use protocol::{
    command::Answer,
    controller::Hosted,
    packet::Packet,
    percept::{Delivery, Tick},
    robot_id::RobotId,
};
use scenario::{ProcessAction, ProcessFault, Scenario};

fn scenario(text: &str) -> Scenario {
    Scenario::parse("beliefs", text, &[]).unwrap_or_else(|error| panic!("{error}"))
}

/// Plays a scenario with the true controllers; `look` sees each tick.
fn play(
    scenario: &Scenario,
    ticks: Tick,
    mut look: impl FnMut(&Arena, &[Option<Answer>], &[Hosted<CoverageController>]),
) {
    let setup = scenario.coverage_setup(0).unwrap();
    let new = |index| {
        let id = RobotId::first(index);
        Hosted::new(id, CoverageController::new(id, setup))
    };
    let mut controllers: Vec<_> = (0..scenario.robot_count()).map(new).collect();
    let mut commands: Vec<_> = controllers.iter_mut().map(|controller| Some(controller.boot())).collect();
    let mut paused = vec![false; controllers.len()];
    let mut arena = Arena::new(scenario).unwrap();
    for _ in 0..=ticks {
        for ProcessFault { robot, action } in arena.process_faults(&[]) {
            assert!(matches!(action, ProcessAction::Pause | ProcessAction::Resume), "nobody here is killed");
            paused[robot as usize] = action == ProcessAction::Pause;
            if action == ProcessAction::Pause {
                commands[robot as usize] = None;
            }
        }
        if let Some(percepts) = arena.tick(&commands) {
            let answers = controllers
                .iter_mut()
                .zip(percepts)
                .zip(&paused)
                .map(|((mind, percept), paused)| (!paused).then(|| mind.step(percept, &mut ())));
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
        for known in controllers[0].controller.neighbors().iter() {
            let now = (known.delivery.packet.sequence(), known.delivery.range.get());
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
        if let Some(age_s) = arena
            .metrics(commands, Attendance::default())
            .staleness_s
            .filter(|_| counts(arena.current_tick()))
        {
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

/// Two robots that move apart, one of them also turning its back: what is measured of robot 1 at robot 0 tells when.
const MOVING: &str = "duration_s = 20.0
     step_s = 0.1
     arena.size_m = [20.0, 20.0]
     robots = { positions_m = [[5.0, 5.0], [6.0, 5.0]], headings_rad = [0.5, 0.0] }
     controller = { law = \"uniform\", gain_per_s = 1e-4, neighbor_timeout_cycles = 100 }
     channel.range_m = 15.0";
const DRIFTING: &str = "{ kind = \"motion\", robots = \"1\", drift_m_per_s = [0.1, 0.05] }";

/// Range and bearing of robot 1 from robot 0, as poses are.
fn truly(poses: &[Pose]) -> (f64, f64) {
    let away = poses[1].position - poses[0].position;
    (libm::hypot(away.x, away.y), libm::atan2(away.y, away.x) - poses[0].heading)
}

fn measured(delivery: &Delivery) -> (f64, f64) {
    (delivery.range.get(), delivery.bearing.get())
}

fn is_near(a: (f64, f64), b: (f64, f64)) -> bool {
    (a.0 - b.0).abs() < 1e-9 && (a.1 - b.1).abs() < 1e-9
}

#[test]
fn a_late_packet_tells_where_its_sender_was_when_it_was_sent() {
    let late = "{ kind = \"delay\", delay_s = 0.5 }";
    let jitter = "{ kind = \"delay\", delay_s = 0.2, jitter_s = 0.8 }";
    let copies = "{ kind = \"duplicate\", probability = 1.0, delay_s = 0.7 }";
    for (fault, latest) in [(late, 5), (jitter, 10), (copies, 7)] {
        let scenario = scenario(&format!("{MOVING}\nfault = [{DRIFTING}, {fault}]"));
        let (mut were, mut seen) = (Vec::new(), Vec::new());
        let mut arena = Arena::new(&scenario).unwrap();
        let setup = scenario.coverage_setup(0).unwrap();
        let mut minds = [0, 1].map(|index| {
            let id = RobotId::first(index);
            Hosted::new(id, CoverageController::new(id, setup))
        });
        let mut commands: Vec<_> = minds.iter_mut().map(|mind| Some(mind.boot())).collect();
        for tick in 0..200 {
            arena.process_faults(&[]);
            let percepts = arena.tick(&commands).unwrap().to_vec();
            were.push(truly(arena.poses()));
            for delivery in &percepts[0].deliveries {
                // On the ideal channel packet n is sent at tick n.
                let sent = delivery.packet.sequence() as usize;
                assert!(
                    is_near(measured(delivery), were[sent]),
                    "{fault}: sent at tick {sent}, heard at {tick}"
                );
                seen.push(tick - sent);
            }
            commands = minds
                .iter_mut()
                .zip(&percepts)
                .map(|(mind, percept)| Some(mind.step(percept, &mut ())))
                .collect();
        }
        assert!(seen.len() > 180 && seen.iter().max() == Some(&latest), "{fault}: {seen:?}");
    }
}

/// The tick in which the channel brings each packet of robot 1 to robot 0, by their numbers.
fn ends(scenario: &Scenario, ticks: Tick) -> Vec<Tick> {
    let poses = [5.0, 6.0].map(|x| Pose::unturned(ArenaPoint::new(x, 5.0)));
    let said = [0, 1].map(|index| Some(Packet::short(RobotId::first(index), 0, None)));
    let mut channel = Channel::new(scenario);
    let (mut packets, mut received, mut ends) = (Packets::default(), Vec::new(), Vec::new());
    for tick in 0..=ticks {
        let cycle = scenario.begins_cycle(tick).then(|| scenario.cycle_of(tick));
        let moment = Moment { tick, cycle, time_s: tick as f64 * 0.1, poses: &poses, said: &said };
        channel.play(&Sequential, &moment, &mut packets, &mut |_, packet| packet, &mut received);
        ends.extend(received.iter().filter(|heard| heard.sender == 1).map(|_| tick));
    }
    ends
}

#[test]
fn a_packet_that_lasts_is_measured_in_the_tick_in_which_it_ends_however_late_it_comes() {
    // Packets of 3.5 ticks in cycles of 10.
    let channel = "channel = { profile = \"isis\", access = \"random\", cycle_s = 1.0, airtime_s = 0.35, range_m = 15.0, \
                   half_duplex = false, sigma_range = 0.0, sigma_bearing_deg = 0.0 }";
    let text = MOVING.replace("channel.range_m = 15.0", channel);
    for (fault, late) in [("", 0), (", { kind = \"delay\", delay_s = 0.4 }", 4)] {
        let scenario = scenario(&format!("{text}\nfault = [{DRIFTING}{fault}]"));
        let ends = ends(&scenario, 200);
        assert!(ends.len() > 15, "{ends:?}");
        let (mut were, mut heard) = (Vec::new(), Vec::new());
        play(&scenario, 200, |arena, _, controllers| {
            were.push(truly(arena.poses()));
            let known =
                controllers[0].controller.neighbors().iter().next().map(|known| measured(&known.delivery));
            if let Some(known) = known.filter(|known| heard.last() != Some(known)) {
                heard.push(known);
            }
        });
        // Each cycle's percept holds what has come since the last one; of two packets the later one is believed.
        let due = |cycle: u64| ends.iter().rev().find(|end| *end + late <= 10 * cycle);
        let mut expected: Vec<_> = (0..=20).filter_map(due).map(|end| were[*end as usize]).collect();
        expected.dedup();
        assert_eq!(heard.len(), expected.len());
        assert!(
            heard.iter().zip(&expected).all(|(heard, was)| is_near(*heard, *was)),
            "{heard:?} {expected:?}"
        );
    }
}

#[test]
fn a_slow_robot_sends_its_last_packet_again_from_where_it_is_by_then() {
    let scenario = scenario(&format!(
        "{MOVING}\nfault = [{DRIFTING}, {{ kind = \"slow\", robots = \"1\", from_s = 2.0, delay_s = 0.5 }}]"
    ));
    let mut sequences = Vec::new();
    play(&scenario, 60, |arena, _, controllers| {
        let known = controllers[0].controller.neighbors().iter().next().unwrap().delivery;
        assert!(is_near(measured(&known), truly(arena.poses())), "a packet is measured when it is sent");
        sequences.push(u64::from(known.packet.sequence()));
    });
    let expected: Vec<u64> = (0..=60)
        .map(|tick| match tick {
            0..20 => tick,
            20..25 => 19,
            _ => tick - 5,
        })
        .collect();
    assert_eq!(sequences, expected);
}

#[test]
fn a_paused_robot_is_silent_and_still_until_the_first_cycle_after_its_pause() {
    // Cycles of five ticks; the pause ends amid one, and the robot answers at the next.
    let scenario = scenario(&format!(
        "{}\nfault = [{{ kind = \"pause\", robots = \"1\", from_s = 1.2, until_s = 2.2 }}]",
        MOVING
            .replace("gain_per_s = 1e-4", "gain_per_s = 0.1, cell_cap_m = 1.0")
            .replace("channel.range_m", "channel.cycle_s = 0.5\nchannel.range_m")
    ));
    let (mut places, mut sent) = (Vec::new(), Vec::new());
    play(&scenario, 40, |arena, _, _| {
        places.push(arena.poses()[1].position);
        sent.push(arena.packets().sent);
    });
    let moves = |tick: usize| places[tick] != places[tick - 1];
    let silent: Vec<usize> =
        (1..=40).filter(|&tick| tick % 5 == 0 && sent[tick] - sent[tick - 1] == 1).collect();
    assert_eq!(silent, [15, 20, 25]);
    let still: Vec<usize> = (1..=40).filter(|&tick| !moves(tick)).collect();
    assert_eq!(still, (12..=25).collect::<Vec<_>>());
}

#[test]
fn of_two_with_one_name_the_one_heard_last_is_known_or_the_one_whose_numbers_are_ahead() {
    let text = "duration_s = 10.0
         step_s = 0.1
         arena.size_m = [4.0, 4.0]
         robots = { positions_m = [[1.0, 1.0], [1.5, 1.0], [1.0, 3.0]], speed_limit_m_per_s = 1e-9 }
         controller = { law = \"uniform\", gain_per_s = 1.0 }
         channel.range_m = 10.0";
    // On the ideal channel packets are heard in the order of who sends them, and robot 2 is 2 m away, robot 1 0.5 m.
    let paused = ", { kind = \"pause\", robots = \"2\", until_s = 0.5 }";
    for (liar, identity, pause, away_m) in
        [(1, 2, "", 2.0), (2, 1, "", 2.0), (1, 2, paused, 0.5), (2, 1, paused, 0.5)]
    {
        let lie = format!("{{ kind = \"liar\", robots = \"{liar}\", identity = {identity} }}");
        play(&scenario(&format!("{text}\nfault = [{lie}{pause}]")), 20, |_, _, controllers| {
            let known: Vec<_> = controllers[0]
                .controller
                .neighbors()
                .iter()
                .map(|known| (known.delivery.packet.sender().index, known.delivery.range.get()))
                .collect();
            let [(index, range_m)] = known[..] else { panic!("{known:?}") };
            assert!(index == identity && (range_m - away_m).abs() < 1e-6, "{liar} {pause}: {known:?}");
        });
    }
}

#[test]
fn of_all_laws_the_quadratic_one_alone_believes_the_readings_of_others() {
    let ends = |law: &str, fault: &str| {
        let text = format!(
            "duration_s = 5.0
             step_s = 0.1
             arena.size_m = [4.0, 4.0]
             arena.boundary_sensing = true
             robots.count = 12
             field = {{ offset = 50.0, gaussian = [{{ center_m = [1.0, 1.0], gamma = 500.0, sigma_m = 1.0 }}] }}
             controller = {{ law = \"{law}\", gain_per_s = 1.0, gradient = \"measured\" }}
             channel.range_m = 10.0
             {fault}"
        );
        let mut ends = Vec::new();
        play(&scenario(&text), 50, |arena, _, _| ends = arena.poses().to_vec());
        ends
    };
    let liar = "fault = [{ kind = \"liar\", robots = \"3-8\", light_counts = 5000.0 }]";
    for law in ["linear", "quadratic", "exact", "uniform"] {
        assert_eq!(ends(law, liar) != ends(law, ""), law == "quadratic", "{law}");
    }
}

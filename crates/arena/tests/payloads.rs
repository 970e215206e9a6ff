//! Payloads on their way: whatever their length, they come out as they were said, and nothing is left of them.

#![allow(clippy::unwrap_used, reason = "these are tests, helpers included")]

use arena::Arena;
use protocol::{
    command::{Answer, Command},
    payload::Payload,
    percept::Percept,
    robot_id::RobotId,
};
use scenario::Scenario;

const ROBOTS: u32 = 10;

fn scenario(sets: &str) -> Scenario {
    let text = format!(
        "duration_s = 1000.0
         step_s = 0.05
         arena.size_m = [2.0, 2.0]
         robots.count = {ROBOTS}
         controller.gain_per_s = 1.0
         {sets}"
    );
    Scenario::parse("payloads", &text, &[]).unwrap_or_else(|error| panic!("{error}"))
}

/// Payload of each of a robot's packets: short and long by turns.
fn payload(sender: RobotId, sequence: u32) -> Payload {
    let len = [128, 4, 5, 0, 10, 127][(sender.index + sequence) as usize % 6];
    let bytes: Vec<u8> = (0..len).map(|at: u32| (at + 31 * sender.index + 7 * sequence) as u8).collect();
    Payload::try_from(&bytes[..]).unwrap()
}

/// Robots that stand still and talk; `look` sees each robot's percepts.
fn play(scenario: &Scenario, ticks: u64, mut look: impl FnMut(&Arena, &Percept)) {
    let mut arena = Arena::new(scenario).unwrap();
    let says = |index, sequence| {
        let sender = RobotId::first(index);
        let command = Command { payload: payload(sender, sequence), ..Command::REST };
        Some(Answer { sender, sequence, command })
    };
    let mut sequence = 0;
    let mut answers: Vec<_> = (0..ROBOTS).map(|index| says(index, sequence)).collect();
    for _ in 0..ticks {
        arena.process_faults(&[]);
        let Some(percepts) = arena.tick(&answers).map(<[_]>::to_vec) else { continue };
        percepts.iter().for_each(|percept| look(&arena, percept));
        sequence += 1;
        answers = (0..ROBOTS).map(|index| says(index, sequence)).collect();
    }
    arena.packets().check().unwrap();
}

#[test]
fn payloads_come_out_as_they_were_said_late_or_twice_and_their_memory_is_bounded() {
    let late = "{ kind = \"delay\", delay_s = 1.0, jitter_s = 2.0 }";
    let twice = "{ kind = \"duplicate\", probability = 0.5, delay_s = 1.5 }";
    let slow = "{ kind = \"slow\", robots = \"0-4\", delay_s = 1.0 }";
    let channels =
        ["range_m = 3.0", "profile = \"isis\", range_m = 3.0", "profile = \"r-one\", range_m = 3.0"];
    for channel in channels {
        let plan = format!("channel = {{ {channel} }}\nfault = [{late}, {twice}, {slow}]");
        let (mut heard, mut long, mut places) = (0, 0, [0; 2]);
        play(&scenario(&plan), 4000, |arena, percept| {
            for delivery in &percept.deliveries {
                let (sender, sequence) = (delivery.packet.sender(), delivery.packet.sequence());
                let said = payload(sender, sequence);
                assert_eq!(percept.payload(delivery), &*said, "{channel}: {sender}, packet {sequence}");
                heard += 1;
                long += u32::from(said.len() > 4);
            }
            let half = usize::from(arena.current_tick() > 2000);
            places[half] = places[half].max(arena.payload_places());
        });
        println!("{channel}: {heard} packets, {long} of them long, in {places:?} places");
        assert!(heard > 10_000 && long > heard / 3, "{channel}: {heard} {long}");
        // At most 100 ticks of ten robots' packets are under way, and as many again may wait to be forgotten.
        assert!(places[1] <= places[0].max(2 * 100 * ROBOTS as usize), "{channel}: {places:?} places");
        assert!(places[1] < 2200, "{channel}: {places:?} places");
    }
}

#[test]
fn short_payloads_take_no_place_beside_their_packets() {
    let mut arena = Arena::new(&scenario("channel.range_m = 3.0")).unwrap();
    let answers: Vec<_> = (0..ROBOTS)
        .map(|index| {
            let command = Command { payload: [7; 4].into(), ..Command::REST };
            Some(Answer { sender: RobotId::first(index), sequence: 0, command })
        })
        .collect();
    for _ in 0..10 {
        let percepts = arena.tick(&answers).unwrap();
        let mut heard =
            percepts.iter().flat_map(|percept| percept.deliveries.iter().map(|heard| percept.payload(heard)));
        assert!(heard.all(|payload| payload == [7; 4]));
    }
    assert_eq!(arena.payload_places(), 0);
}

use std::{
    thread,
    time::{Duration, Instant},
};

use protocol::{
    percept::Delivery,
    robot_id::RobotId,
    units::{Meters, Radians},
};

use scenario::RobotSet;

use super::*;

/// Longer than anything here takes, as counts of any clock: 2³⁰ is more than 0.2 s.
const FAR: u64 = 1 << 30;

fn recorder(mode: Mode) -> Recorder {
    let mut recorder = Recorder::new(2, mode, &Measure::default());
    recorder.begin(&[None, None]);
    recorder
}

fn packet(index: u32, sequence: u32) -> Packet {
    Packet::short(RobotId::first(index), sequence, None)
}

/// Two robots, each of which hears the other one's packet with number `sequence`.
fn percepts(tick: Tick, sequence: u32) -> Vec<Percept> {
    [1, 0]
        .map(|sender| {
            let mut percept = Percept::empty(tick);
            percept.deliveries.push(Delivery {
                packet: packet(sender, sequence),
                range: Meters::new(1.0).unwrap(),
                bearing: Radians::new(0.0).unwrap(),
                orientation: Radians::new(0.0).unwrap(),
            });
            percept
        })
        .into()
}

/// Times of an agent that has woken up now, and worked no time at all but for the cell.
fn times(recorder: &Recorder) -> RawTimes {
    RawTimes { woke: recorder.clock.now().0, cell: 1, ..RawTimes::default() }
}

fn hand_out_and_ring(recorder: &mut Recorder, tick: Tick) {
    recorder.begin_round(tick);
    recorder.hand_out(&[0, 1], &percepts(tick, tick as u32));
    recorder.ring();
    recorder.digest();
}

/// One exchange in which both robots answer, changed by `change`.
fn exchange(recorder: &mut Recorder, tick: Tick, change: impl Fn(&mut RawTimes)) {
    hand_out_and_ring(recorder, tick);
    for index in 0..2 {
        let mut times = times(recorder);
        change(&mut times);
        // Time for what it claims to have done.
        thread::sleep(Duration::from_micros(50));
        recorder.note(index, tick, &packet(index as u32, tick as u32 + 1), &times);
    }
}

fn finish(mut recorder: Recorder) -> Profile {
    recorder.finish([None, None]).unwrap()
}

#[test]
fn each_cycle_is_known_once_the_next_one_tells_its_end() {
    let mut recorder = recorder(Mode::Lockstep);
    for tick in 0..700 {
        exchange(&mut recorder, tick, |times| times.publish_before = u32::from(tick > 0));
    }
    let profile = finish(recorder);
    for robot in &profile.robots {
        assert_eq!(robot.cycles, 699, "the last one has no end");
        assert_eq!(robot.histograms.of(Span::Cycle).len(), 699);
        assert_eq!(robot.counts, 699 * 2, "one count of cell, one of publishing");
        assert!(robot.histograms.of(Span::Stage(Stage::Wake)).max() > 0);
    }
    assert_eq!((profile.cycles_left_out, profile.over_all().of(Span::Cycle).len()), (0, 1398));
}

#[test]
fn a_packet_takes_two_ways_and_not_what_lies_between() {
    let mut recorder = recorder(Mode::Lockstep);
    let ms = |recorder: &Recorder, ms: u64| {
        let rate = recorder.began.unwrap().rate;
        (ms as f64 * 1e3 * rate.per_us()) as u64
    };
    hand_out_and_ring(&mut recorder, 0);
    let published = recorder.clock.now().0;
    thread::sleep(Duration::from_millis(3));
    for index in 0..2 {
        let times = RawTimes { woke: published, ..RawTimes::default() };
        recorder.note(index, 0, &packet(index as u32, 1), &times);
    }
    // The arena's own work, which is not to be seen.
    thread::sleep(Duration::from_millis(50));
    hand_out_and_ring(&mut recorder, 1);
    let handed_out = recorder.journal.handed_out(1, 1).unwrap().1;
    // It sees the ring at once and takes 2 ms to read.
    let times =
        RawTimes { woke: recorder.clock.now().0, receive: ms(&recorder, 2) as u32, ..RawTimes::default() };
    thread::sleep(Duration::from_millis(3));
    recorder.note(0, 1, &packet(0, 2), &times);
    let second_ms = times.received().since(handed_out).unwrap() as f64 / ms(&recorder, 1) as f64;
    let profile = finish(recorder);
    let packet = profile.robots[0].histograms.of(Span::Packet);
    assert_eq!(packet.len(), 1);
    let measured_ms = packet.min() as f64 / 1e6;
    assert!(measured_ms >= 3.0 + second_ms - 0.1, "{measured_ms} ms, of them {second_ms}");
    assert!(measured_ms < 45.0, "{measured_ms} ms");
    assert_eq!(profile.robots[1].histograms.of(Span::Packet).len(), 0, "it has not read its percept");
    // Both heard a packet at tick 0 that nobody has sent.
    assert_eq!(profile.packets_unknown, 2);
}

#[test]
fn what_makes_no_sense_is_left_out_and_counted() {
    let lies: [fn(&mut RawTimes); 5] = [
        |times| times.woke -= FAR,
        |times| times.woke += FAR,
        |times| times.woke = u64::MAX,
        |times| times.cell = u32::MAX,
        |times| times.publish_before = u32::MAX,
    ];
    for (index, lie) in lies.into_iter().enumerate() {
        let mut recorder = recorder(Mode::Lockstep);
        for tick in 0..10 {
            exchange(&mut recorder, tick, lie);
        }
        let profile = finish(recorder);
        let refused = if index == 4 { 2 * 9 } else { 2 * 10 };
        assert_eq!(profile.cycles_left_out, refused, "lie {index}");
        assert!(profile.over_all().of(Span::Cycle).is_empty(), "lie {index}");
    }
}

#[test]
fn who_measures_nothing_is_no_liar() {
    let mut recorder = recorder(Mode::Lockstep);
    exchange(&mut recorder, 0, |times| *times = RawTimes::default());
    let profile = finish(recorder);
    assert_eq!((profile.cycles_left_out, profile.robots[0].cycles), (0, 0));
    assert_eq!(profile.robots[0].counts_per_cycle(), None);
}

#[test]
fn a_new_life_ends_no_cycle_of_the_old_one() {
    let mut recorder = recorder(Mode::Lockstep);
    exchange(&mut recorder, 0, |_| {});
    exchange(&mut recorder, 1, |_| {});
    recorder.reborn(0);
    exchange(&mut recorder, 2, |_| {});
    let profile = finish(recorder);
    assert_eq!([0, 1].map(|index| profile.robots[index].cycles), [1, 2]);
}

#[test]
fn in_real_time_lateness_is_the_timers_own_and_answers_may_come_late() {
    let mut recorder = recorder(Mode::Realtime);
    hand_out_and_ring(&mut recorder, 0);
    let read_first = RawTimes { late_ns: 1000, ..times(&recorder) };
    recorder.note(1, 0, &packet(1, 1), &times(&recorder));
    hand_out_and_ring(&mut recorder, 1);
    // Robot 0 answers tick 0 only now, and tick 1 right after.
    recorder.note(0, 0, &packet(0, 1), &read_first);
    let read_second = RawTimes { late_ns: 1300, publish_before: 1, ..times(&recorder) };
    recorder.note(0, 1, &packet(0, 2), &read_second);
    recorder.missed(0, 2);
    recorder.reborn(0);
    hand_out_and_ring(&mut recorder, 2);
    recorder.note(0, 2, &packet(0, 3), &times(&recorder));
    recorder.missed(0, 1);
    let profile = finish(recorder);
    let robot = &profile.robots[0];
    assert_eq!(robot.cycles, 1);
    assert_eq!(robot.missed_deadlines, 3, "of both lives");
    let wake = robot.histograms.of(Span::Stage(Stage::Wake));
    assert!(wake.equivalent(wake.min(), 1000) && wake.len() == 1);
    let jitter = robot.histograms.of(Span::Jitter);
    assert!(jitter.equivalent(jitter.min(), 300) && jitter.len() == 1, "none across lives");
    // Robot 1's first packet was heard with tick 1, and its origin was known by then.
    assert_eq!(robot.histograms.of(Span::Packet).len(), 1);
}

#[test]
fn recent_cycles_are_known_as_long_as_somebody_watches() {
    let watched = WatchedCycles::default();
    let measure = Measure { watched: watched.clone(), ..Measure::default() };
    let mut recorder = Recorder::new(2, Mode::Lockstep, &measure);
    recorder.begin(&[None, None]);
    let cycles = |index| watched.with(|recent| recent.cycles(index)).flatten();
    exchange(&mut recorder, 0, |_| {});
    watched.watch(2, true);
    assert_eq!(cycles(0), None, "it had none since");
    for tick in 1..40 {
        watched.watch(2, true);
        exchange(&mut recorder, tick, |times| times.centroid = 2);
    }
    let times = watched.with(|recent| recent.times(Instant::now())).unwrap();
    assert_eq!(times.cycle.unwrap().count, 2 * 39, "without waiting for a robot's turn");
    assert!(times.packet.is_some() && cycles(1).unwrap().wake_us > 0.0);
    recorder.reborn(1);
    assert!(cycles(1).is_none() && cycles(0).is_some());
    watched.watch(2, false);
    assert_eq!(cycles(0), None);
}

#[test]
fn whole_cycles_are_told_one_by_one_of_robots_that_are_asked_for() {
    let measure = Measure { cycles_of: RobotSet::of([1]), ..Measure::default() };
    let mut recorder = Recorder::new(2, Mode::Lockstep, &measure);
    recorder.begin(&[None, None]);
    (0..4).for_each(|tick| exchange(&mut recorder, tick, |_| {}));
    let mut cycles = Vec::new();
    recorder.take_cycles(&mut cycles);
    // The present one is not whole, and the one before is known once its successor has begun.
    assert_eq!(cycles.iter().map(|cycle| (cycle.robot, cycle.tick)).collect::<Vec<_>>(), [(1, 0), (1, 1)]);
    let numbers = cycles.iter().map(|cycle| cycle.packet.unwrap().sequence);
    assert!(numbers.eq([1, 2]), "{cycles:?}");
    finish(recorder);
}

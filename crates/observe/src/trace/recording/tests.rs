use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::PathBuf,
};

use profile::PacketNumber;
use protocol::{
    packet::Packet,
    percept::Delivery,
    robot_id::RobotId,
    units::{Meters, Radians},
};
use serde_json::{Map, Value};
use tempfile::TempDir;

use super::*;
use crate::trace::{bound::about_left_out, file::TraceFile};

/// Length of a tick in these tests: longer than a cycle.
const TICK_NS: u64 = 1_000_000;
/// Cycles are known so many ticks later, as in lock-step.
const LATE: Tick = 2;

/// A recording in a folder of its own.
struct Traced {
    recording: Recording,
    path: PathBuf,
    _folder: TempDir,
}

/// A trace that was read back.
struct Trace {
    whole: Value,
    bytes: u64,
}

impl Traced {
    fn new(robots: u32, bytes_max: u64, is_traced: impl Fn(u32) -> bool) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("trace.json");
        let about = Map::from_iter(about_left_out());
        let file = TraceFile::begin(&path, bytes_max, &Recording::first_events(), about).unwrap();
        let recording = Recording::new(Bound::new(file), Mode::Lockstep, robots, is_traced);
        Self { recording, path, _folder: folder }
    }

    /// All robots hear all, and answer.
    fn tick(&mut self, tick: Tick) {
        let robots = self.recording.robots.len() as u32;
        let packet = |robot, tick| Packet::short(RobotId::first(robot), tick as u32, None);
        self.recording.tick_begins(tick, &[]);
        let mut percept = Percept::empty(tick);
        if let Some(before) = tick.checked_sub(1) {
            percept.deliveries = (0..robots)
                .map(|robot| Delivery {
                    packet: packet(robot, before),
                    range: Meters::new(1.0).unwrap(),
                    bearing: Radians::new(0.0).unwrap(),
                    orientation: Radians::new(0.0).unwrap(),
                })
                .collect();
        }
        self.recording.hand_out(tick, &vec![percept; robots as usize]);
        if let Some(known) = tick.checked_sub(LATE) {
            (0..robots).for_each(|robot| self.recording.cycles(&[cycle(robot, known)]));
        }
        self.recording.tick_ends(stamps(tick), std::iter::empty());
    }

    fn read(&self) -> Trace {
        let text = fs::read(&self.path).unwrap();
        Trace { whole: serde_json::from_slice(&text).unwrap(), bytes: text.len() as u64 }
    }

    fn finish(mut self, ticks: Tick) -> Trace {
        let robots = self.recording.robots.len() as u32;
        for known in ticks.saturating_sub(LATE)..ticks {
            (0..robots).for_each(|robot| self.recording.cycles(&[cycle(robot, known)]));
        }
        self.recording.finish().unwrap();
        self.read()
    }
}

/// A tick's parts are as long as they are few.
fn stamps(tick: Tick) -> TickStamps {
    let began_ns = tick * TICK_NS;
    let after = |parts: u64| began_ns + parts * TICK_NS / 8;
    TickStamps {
        began_ns,
        ready_ns: Some(after(1)),
        sent_ns: Some(after(2)),
        answered_ns: Some(after(3)),
        ended_ns: after(4),
    }
}

fn cycle(robot: u32, tick: Tick) -> CycleTimes {
    let woke_ns = (tick + 1) * TICK_NS + u64::from(robot) * 100;
    let packet = Some(PacketNumber { incarnation: 0, sequence: tick as u32 });
    CycleTimes { robot, tick, woke_ns, stages_ns: [5_000, 1_001, 2, 30_000, 400, 50, 0, 6_000], packet }
}

impl Trace {
    fn events(&self, ph: &str, name: &str) -> Vec<&Value> {
        let events = self.whole["traceEvents"].as_array().unwrap().iter();
        events.filter(|event| event["ph"] == ph && event["name"] == name).collect()
    }

    /// Ticks of the slices called `name`, by process and thread.
    fn ticks(&self, name: &str) -> BTreeMap<(u64, u64), Vec<u64>> {
        let mut ticks = BTreeMap::<_, Vec<u64>>::new();
        for slice in self.events("X", name) {
            let track = (slice["pid"].as_u64().unwrap(), slice["tid"].as_u64().unwrap());
            ticks.entry(track).or_default().push(slice["args"]["tick"].as_u64().unwrap());
        }
        ticks
    }
}

#[test]
fn stages_lie_in_their_cycle_and_arrows_in_the_stages_they_join() {
    let mut traced = Traced::new(2, 1 << 20, |_| true);
    (0..5).for_each(|tick| traced.tick(tick));
    let trace = traced.finish(5);
    assert_eq!(trace.whole["otherData"], json!({ "first_tick_left_out": null, "cycles_left_out": 0 }));
    let names = trace.events("M", "thread_name");
    assert!(names.iter().map(|name| &name["args"]["name"]).eq(["arena", "robot 0", "robot 1"]));
    let all: Vec<_> = (0..5).collect();
    assert_eq!(trace.ticks("cycle"), BTreeMap::from([((2, 1000), all.clone()), ((2, 1001), all.clone())]));
    assert_eq!(trace.ticks("tick"), BTreeMap::from([((1, 1), all)]));
    for stage in Stage::ALL {
        assert_eq!(trace.events("X", stage.name()).len(), 10, "{stage:?}");
    }
    for part in ["world", "hand out", "wait for agents"] {
        assert_eq!(trace.events("X", part).len(), 5, "{part}");
    }
    let at = |event: &Value| (event["ts"].as_f64().unwrap(), event["dur"].as_f64().unwrap_or(0.0));
    let first = |name: &str| at(trace.events("X", name)[0]);
    assert_eq!((first("wake"), first("cycle")), ((995.0, 5.0), (1000.0, 37.453)));
    assert_eq!((first("receive"), first("neighbors")), ((1000.0, 1.001), (1001.001, 0.002)));
    assert_eq!(first("publish"), (1031.453, 6.0));
    // In each tick but the first, both hear both.
    let (sent, received) = (trace.events("s", "packet"), trace.events("f", "packet"));
    assert_eq!((sent.len(), received.len()), (16, 16));
    assert_eq!((at(sent[0]).0, at(received[0]).0), (1037.452, 2001.0));
    assert!(received.iter().all(|event| event["bp"] == "e"));
    let ids = |events: &[&Value]| events.iter().map(|event| event["id"].as_u64()).collect::<Vec<_>>();
    assert_eq!(ids(&sent), ids(&received));
    assert_eq!(ids(&sent).into_iter().collect::<BTreeSet<_>>().len(), 16, "each its own");
}

#[test]
fn only_some_are_traced_and_only_arrows_among_them_are_drawn() {
    let mut traced = Traced::new(3, 1 << 20, |index| index != 1);
    traced.recording.tick_begins(0, &[]);
    let incident = |robot| Incident { robot, tick: 0, what: "it died".into() };
    (0..2).for_each(|robot| traced.recording.incident(&incident(robot)));
    (1..4).for_each(|tick| traced.tick(tick));
    let trace = traced.finish(4);
    assert!(trace.ticks("cycle").into_keys().eq([(2, 1000), (2, 1002)]));
    let arrows = trace.events("s", "packet").len();
    assert_eq!(arrows, 3 * 2 * 2, "of three ticks, each to both");
    let tracks: Vec<_> = trace.events("i", "incident").iter().map(|it| (&it["pid"], &it["tid"])).collect();
    assert_eq!(
        tracks,
        [(&json!(2), &json!(1000)), (&json!(1), &json!(1))],
        "the arena's, for who has no track"
    );
}

#[test]
fn a_full_trace_has_whole_ticks_up_to_one_that_it_names() {
    for bytes_max in [20_000, 50_000, 100_000, 300_000, 600_000] {
        let mut traced = Traced::new(4, bytes_max, |_| true);
        (0..400).for_each(|tick| traced.tick(tick));
        let trace = traced.finish(400);
        assert!(trace.bytes <= bytes_max, "{} of {bytes_max}", trace.bytes);
        let other = &trace.whole["otherData"];
        let from = other["first_tick_left_out"].as_u64().unwrap();
        assert!((1..400).contains(&from), "{from}");
        let kept: Vec<_> = (0..from).collect();
        assert_eq!(trace.ticks("tick"), BTreeMap::from([((1, 1), kept.clone())]), "{bytes_max}");
        let cycles = trace.ticks("cycle");
        assert_eq!(cycles.len(), 4);
        assert!(cycles.values().all(|ticks| *ticks == kept), "{bytes_max}");
        assert_eq!(other["cycles_left_out"], 4 * (400 - from));
        let marks = trace.events("i", "the trace is full");
        assert_eq!((marks.len(), &marks[0]["args"]), (1, &json!({ "tick": from })));
        assert_eq!(trace.events("s", "packet").len() as u64, (from - 1) * 16);
        // Beside what is kept for what is under way.
        if bytes_max >= 100_000 {
            assert!(trace.bytes > bytes_max - 60_000, "{} of {bytes_max}", trace.bytes);
        }
    }
}

#[test]
fn a_run_that_is_killed_leaves_a_trace_that_can_be_read() {
    let mut traced = Traced::new(4, 1 << 30, |_| true);
    (0..100).for_each(|tick| traced.tick(tick));
    let trace = traced.read();
    assert!(!trace.ticks("tick").is_empty(), "{} bytes", trace.bytes);
}

#[test]
fn a_cycle_that_overlaps_the_last_one_is_left_out_and_counted() {
    let mut traced = Traced::new(1, 1 << 20, |_| true);
    let first = cycle(0, 0);
    let second = CycleTimes { tick: 1, woke_ns: first.woke_ns + first.cycle_ns() - 1, ..first };
    let third = CycleTimes { tick: 2, woke_ns: second.woke_ns + 1, ..first };
    traced.recording.cycles(&[first, second, third]);
    traced.recording.finish().unwrap();
    let trace = traced.read();
    assert_eq!(trace.ticks("cycle"), BTreeMap::from([((2, 1000), vec![0, 2])]));
    assert_eq!(trace.whole["otherData"]["cycles_left_out"], 1);
    let wakes = trace.events("X", "wake");
    assert_eq!(wakes[1]["dur"].as_f64(), Some(0.0), "its timer was due before the last cycle had ended");
}

#[test]
fn a_fault_begins_and_ends_once_and_strikes_the_robots_it_strikes() {
    let toml = include_str!("../../../../../scenarios/swarmbots.toml");
    let plan = "fault=[{ kind = \"pause\", from_s = 0.2, until_s = 0.4, robots = \"1\" }, \
                { kind = \"loss\", from_s = 0.1, probability = 1.0 }]";
    let sets = ["robots.count=3", "step_s=0.1", plan].map(|set| set.parse().unwrap());
    let scenario = scenario::Scenario::parse("test", toml, &sets).unwrap();
    let mut arena = arena::Arena::new(&scenario).unwrap();
    let mut traced = Traced::new(3, 1 << 20, |_| true);
    for tick in 0..8 {
        let process_faults = arena.process_faults(&[]);
        traced.recording.tick_begins(tick, &process_faults);
        arena.tick(&[const { None }; 3]);
        traced.recording.tick_ends(stamps(tick), arena.ledger());
    }
    traced.recording.finish().unwrap();
    let trace = traced.read();
    let instant =
        |name: &str| trace.events("i", name).into_iter().map(|it| it["args"].clone()).collect::<Vec<_>>();
    for (name, args) in [
        ("pause", json!({ "kind": "pause", "tick": 2 })),
        ("resume", json!({ "kind": "pause", "tick": 4 })),
        ("pause begins", json!({ "kind": "pause", "fault": 0, "tick": 2 })),
        ("pause ends", json!({ "kind": "pause", "fault": 0, "tick": 4 })),
    ] {
        assert_eq!(instant(name), [args], "{name}");
    }
    assert!(instant("loss begins").is_empty(), "nobody spoke");
}

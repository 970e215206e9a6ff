//! The text is what Prometheus reads: a strict parser of it, which knows the rules that matter.

use std::{collections::BTreeMap, fs};

use engine::{Awaited, Waited, Waiting};
use profile::RecentCycles;
use protocol::{robot_id::RobotId, setup::Mode};

use super::*;
use crate::live::{About, Robot};

/// Labels of a sample, as they stand there.
type Samples = BTreeMap<(String, String), f64>;

/// Samples by name and labels. Every sample must come right after the head of its metric; every metric has one head.
fn parse(text: &str) -> Samples {
    let (mut samples, mut heads) = (Samples::new(), BTreeMap::new());
    let mut lines = text.lines().peekable();
    assert!(text.ends_with('\n'));
    while let Some(help) = lines.next() {
        let (name, words) = help.strip_prefix("# HELP ").unwrap().split_once(' ').unwrap();
        assert!(name.starts_with("lamplight_") && words.ends_with('.'), "{help}");
        assert!(name.bytes().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == b'_'), "{name}");
        let head = lines.next().unwrap();
        let kind = head.strip_prefix(&format!("# TYPE {name} ")).unwrap();
        assert!(heads.insert(name, kind).is_none(), "{name} has two heads");
        assert_eq!(kind == "counter", name.ends_with("_total"), "{name} is a {kind}");
        while let Some(line) = lines.next_if(|line| !line.starts_with('#')) {
            let (key, value) = line.rsplit_once(' ').unwrap();
            let (sample, labels) = match key.split_once('{') {
                Some((sample, labels)) => (sample, labels.strip_suffix('}').unwrap()),
                None => (key, ""),
            };
            let suffix = sample.strip_prefix(name).unwrap();
            assert!(suffix.is_empty() || kind == "summary" && ["_sum", "_count"].contains(&suffix), "{line}");
            assert_eq!(kind == "summary" && suffix.is_empty(), labels.contains("quantile=\""), "{line}");
            let before = samples.insert((sample.into(), labels.into()), value.parse().unwrap());
            assert_eq!(before, None, "{key} is there twice");
        }
    }
    samples
}

fn quantiles(us: f64) -> Quantiles {
    Quantiles { p50_us: us, p90_us: 2.0 * us, p99_us: 3.0 * us, max_us: 4.0 * us, count: 7, sum_s: 0.5 }
}

/// A run of `robots` in which everything is there that there can be.
fn full(robots: u32) -> Snapshot {
    let of = About {
        run: "lab".into(),
        scenario: "a \"b\"\\\n".into(),
        engine: "processes".into(),
        mode: Mode::Lockstep,
        arena_pid: 1,
    };
    let robot = |index| Robot {
        id: RobotId { index, incarnation: 2 },
        pid: Some(100 + index),
        participation: if index == 0 { Participation::Down } else { Participation::Present },
        cycles: Some(RecentCycles { last_us: 1.0, p99_us: 20.0, wake_us: 3.0 }),
        missed_deadlines: Some(4),
        refused: 5,
    };
    let waited =
        Waited { id: RobotId::first(17), pid: Some(117), state: Some("stopped".into()), for_s: 1.25 };
    Snapshot {
        tick: 812,
        time_s: 40.6,
        wall_s: 20.3,
        tick_time: Some(quantiles(1000.0)),
        agents: Some(RecentTimes {
            stages: [Some(quantiles(10.0)); Stage::ALL.len()],
            cycle: Some(quantiles(30.0)),
            packet: None,
        }),
        robots: (0..robots).map(robot).collect(),
        waiting: Some(Waiting { what: Awaited::Answer, tick: 813, count: 1, robots: vec![waited] }),
        ..Snapshot::begin(of, 2400)
    }
}

fn value(samples: &Samples, name: &str, labels: &str) -> f64 {
    *samples.get(&(name.into(), labels.into())).unwrap_or_else(|| panic!("no {name}{{{labels}}}"))
}

#[test]
fn everything_that_is_known_is_there_once() {
    let samples = parse(&text(&full(50)));
    let value = |name, labels| value(&samples, name, labels);
    assert_eq!(value("lamplight_ticks_total", ""), 812.0);
    assert_eq!(value("lamplight_real_time_factor", ""), 2.0);
    assert_eq!(value("lamplight_tick_duration_seconds", "quantile=\"0.99\""), 0.003);
    assert_eq!(value("lamplight_tick_duration_seconds_count", ""), 7.0);
    let wake = "stage=\"wake\",quantile=\"0.5\"";
    assert_eq!(value("lamplight_agent_stage_duration_seconds", wake), 1e-5);
    assert_eq!(value("lamplight_robot_waiting_seconds", "robot=\"17\",state=\"stopped\""), 1.25);
    assert_eq!(value("lamplight_robots", "standing=\"present\""), 49.0);
    assert_eq!(value("lamplight_robot_present", "robot=\"0\""), 0.0);
    assert_eq!(value("lamplight_robot_cycle_p99_seconds", "robot=\"49\""), 2e-5);
    let info = "run=\"lab\",scenario=\"a \\\"b\\\"\\\\\\n\",engine=\"processes\",mode=\"lockstep\"";
    assert_eq!(value("lamplight_run_info", info), 1.0);
}

#[test]
fn before_anything_is_known_the_text_is_as_strict() {
    let samples = parse(&text(&Snapshot::begin(crate::live::snapshot::about(), 10)));
    assert_eq!(value(&samples, "lamplight_waiting_robots", ""), 0.0);
    assert!(!samples.keys().any(|(name, _)| name.starts_with("lamplight_tick_duration")));
}

#[test]
fn robots_beyond_the_bound_are_counted() {
    let samples = parse(&text(&full(ROBOTS_MAX as u32 + 76)));
    assert_eq!(value(&samples, "lamplight_robots_without_metrics", ""), 76.0);
    let named = samples.keys().filter(|(name, _)| name == "lamplight_robot_present").count();
    assert_eq!(named, ROBOTS_MAX);
    assert_eq!(value(&samples, "lamplight_robots", "standing=\"present\""), 1099.0);
}

/// Every word of a text that is the name of a metric, or would be one.
fn names(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| !c.is_ascii_alphanumeric() && c != '_').filter(|word| word.starts_with("lamplight_"))
}

#[test]
fn the_dashboard_and_the_guide_name_what_there_is() {
    let text = text(&full(50));
    let heads: Vec<&str> =
        text.lines().filter_map(|line| line.strip_prefix("# TYPE ")?.split(' ').next()).collect();
    let is_there = |name: &str| {
        let whole = name.strip_suffix("_sum").or_else(|| name.strip_suffix("_count"));
        heads.iter().any(|head| *head == name || Some(*head) == whole)
    };
    let docs = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/");
    let read = |name: &str| fs::read_to_string(format!("{docs}{name}")).unwrap();
    let dashboard: serde_json::Value = serde_json::from_str(&read("grafana.json")).unwrap();
    let mut shown = 0;
    for panel in dashboard["panels"].as_array().unwrap() {
        for target in panel["targets"].as_array().unwrap() {
            let query = target["expr"].as_str().unwrap();
            assert!(names(query).next().is_some(), "{query} asks for nothing of ours");
            names(query).for_each(|name| assert!(is_there(name), "{query}: there is no {name}"));
            shown += 1;
        }
    }
    assert!(shown >= 10, "{shown} queries");
    let guide = read("live.md");
    names(&guide).for_each(|name| assert!(is_there(name), "docs/live.md: there is no {name}"));
    heads
        .iter()
        .for_each(|head| assert!(names(&guide).any(|name| name == *head), "docs/live.md lacks {head}"));
}

//! The log of a run: who says what and when, whole lines, and nobody is held up by a reader.

#![allow(clippy::unwrap_used, reason = "these are tests, helpers included")]

use std::{collections::BTreeSet, fs, process::Output};

use rustix::process::Signal;
use serde_json::Value;
use tests::{
    live::{LiveRun, signal, wait_until},
    programs::{Run, lamplight, program, said, scenario},
};

const KEYS: [&str; 9] =
    ["fields", "incarnation", "level", "message", "robot", "run", "target", "tick", "unix_s"];

/// Every line, which must be one object with the keys of all lines.
fn objects(text: &str) -> Vec<Value> {
    let object = |line: &str| -> Value {
        let object: Value = serde_json::from_str(line).unwrap_or_else(|error| panic!("{error}: {line}"));
        let keys: Vec<&str> = object.as_object().unwrap().keys().map(String::as_str).collect();
        assert_eq!(keys, KEYS, "{line}");
        object
    };
    text.lines().map(object).collect()
}

fn stderr(output: &Output) -> &str {
    std::str::from_utf8(&output.stderr).unwrap()
}

/// Robots whose agents say `message`, each with the run's name, and at a tick that `is_right`.
fn who_says(objects: &[Value], message: &str, run: &str, is_right: impl Fn(&Value) -> bool) -> BTreeSet<u64> {
    let said = objects.iter().filter(|object| object["message"] == message);
    said.map(|object| {
        assert_eq!(object["run"], run, "{object}");
        assert_eq!((&object["level"], &object["incarnation"]), (&"DEBUG".into(), &0.into()), "{object}");
        assert_eq!(object["target"], "robot_agent");
        assert!(is_right(&object["tick"]), "{object}");
        object["robot"].as_u64().unwrap()
    })
    .collect()
}

#[test]
fn every_line_of_json_says_run_robot_and_tick_and_is_kept_with_the_results() {
    let filter = "lamplight=info,robot_agent=debug";
    let run = LiveRun::start_logging(
        "swarmbots",
        &["--robots", "8", "--duration", "2", "--log", "json"],
        Some(filter),
    );
    let (name, kept) = (run.name.clone(), run.out().join("log.jsonl"));
    wait_until("the first line is kept", || kept.exists());
    let (output, left) = run.finish();
    assert!(output.status.success(), "{}", said(&output));
    let left = left.unwrap();
    let text = fs::read_to_string(left.file("log.jsonl")).unwrap();
    assert_eq!(text, stderr(&output), "what is kept is what was shown");
    let objects = objects(&text);
    let everyone: BTreeSet<u64> = (0..8).collect();
    assert_eq!(who_says(&objects, "has joined", &name, Value::is_null), everyone, "{text}");
    let at_the_end = |tick: &Value| (1..=20).contains(&tick.as_u64().unwrap());
    assert_eq!(who_says(&objects, "leaves", &name, at_the_end), everyone, "{text}");
}

#[test]
fn text_is_kept_too_and_the_arena_says_at_which_tick() {
    let run = LiveRun::start("swarmbots", &["--speed", "40", "--duration", "40"]);
    run.wait_until_moving();
    signal(run.agents()[&7], Signal::KILL);
    let (output, left) = run.finish();
    assert!(output.status.success(), "{}", said(&output));
    let text = fs::read_to_string(left.unwrap().file("log.txt")).unwrap();
    assert!(stderr(&output).ends_with(&text), "{}", said(&output));
    let line = text.lines().find(|line| line.contains("robot 7 (pid ")).unwrap();
    let (tick, what) = line.strip_prefix(" WARN tick ").unwrap().split_once(": ").unwrap();
    assert!((1..=400).contains(&tick.parse::<u64>().unwrap()), "{line}");
    assert!(what.contains(") died ") && what.contains("; it is left out from tick "), "{line}");
}

#[test]
fn a_log_that_nobody_reads_holds_no_robot_up_and_loses_whole_lines() {
    const OPTIONS: [&str; 4] = ["--robots", "20", "--duration", "90"];
    // Standard error is a pipe that is not read before the results are there.
    let run = LiveRun::start_logging(
        "swarmbots",
        &[&OPTIONS[..], &["--log", "json"]].concat(),
        Some("robot_agent=trace"),
    );
    let summary = run.out().join("summary.json");
    wait_until("the results are there", || summary.exists());
    let (output, left) = run.finish();
    assert!(output.status.success(), "{}", said(&output));
    let answers =
        objects(stderr(&output)).iter().filter(|object| object["message"] == "has answered").count();
    assert!((100..20 * 900).contains(&answers), "{answers} of 18000 lines are there");
    let alone = Run::of("swarmbots", &[&OPTIONS[..], &["--engine", "in-process"]].concat());
    assert_eq!(left.unwrap().digest(), alone.digest());
}

#[test]
fn a_program_prints_as_much_as_it_likes_and_loses_no_robot() {
    let folder = tempfile::tempdir().unwrap();
    let digest = |lines: u32| {
        let file = folder.path().join(format!("lines-{lines}.toml"));
        let text = format!(
            "duration_s = 1\nstep_s = 0.1\narena.size_m = [2, 2]\nrobots.count = 8\nchannel.range_m = 1\n\
             [[controller]]\nprogram = [{:?}]\nparams = {{ lines_per_step = {lines} }}\n",
            program("scripted-agent")
        );
        fs::write(&file, text).unwrap();
        let out = folder.path().join(format!("out-{lines}"));
        let run = lamplight(["run", "--out"]).arg(&out).arg(&file).output().unwrap();
        assert!(run.status.success(), "{}", said(&run));
        let summary: Value =
            serde_json::from_str(&fs::read_to_string(out.join("summary.json")).unwrap()).unwrap();
        assert_eq!(summary["robots_alive"], 8);
        let log = fs::read_to_string(out.join("log.txt")).unwrap_or_default();
        // Whole and of one robot each, however small the pieces are that it printed them in.
        let printed = log.lines().filter(|line| {
            let told = line.strip_prefix("robot ").and_then(|line| line.split_once(": step "));
            told.is_some_and(|(robot, rest)| robot.parse::<u32>().is_ok() && rest.ends_with(&"-".repeat(80)))
        });
        assert_eq!(printed.count(), 8 * 11 * lines as usize);
        summary["digest"].clone()
    };
    // 8 robots, 11 steps, 100 bytes a line: some 9 MB, of which a pipe holds 64 kB.
    assert_eq!(digest(1000), digest(0));
}

#[test]
fn agents_that_log_at_every_tick_survive_the_death_of_their_reader() {
    let options = ["--robots", "20", "--speed", "40", "--duration", "400", "--log", "json"];
    let run = LiveRun::start_logging("swarmbots", &options, Some("robot_agent=trace,arena_daemon=info"));
    run.wait_until_moving();
    signal(run.supervisor(), Signal::KILL);
    wait_until("the arena has left", || run.arena().is_none());
    let (_, left) = run.finish();
    let left = left.unwrap();
    assert_eq!(left.summary["ended"], "interrupted");
    assert_eq!(left.summary["robots_alive"], 20, "nobody died of a line");
    let kept = fs::read_to_string(left.file("log.jsonl")).unwrap();
    assert!(objects(&kept).iter().any(|object| object["message"] == "has answered"), "{kept}");
}

#[test]
fn failures_are_lines_of_json_too_and_a_format_is_text_or_json() {
    let mut command = lamplight(["run", "--log", "json", "--set", "robots.count=0"]);
    let output = command.arg(scenario("swarmbots")).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    let objects = objects(stderr(&output));
    assert_eq!((&objects[0]["level"], objects.len()), (&"ERROR".into(), 1));
    let output = lamplight(["run", "--log", "xml"]).arg(scenario("swarmbots")).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("[possible values: text, json]"), "{}", said(&output));
}

#[test]
fn a_format_of_the_environment_that_is_none_is_told_once_whatever_the_filter() {
    let told = " WARN LAMPLIGHT_LOG: `xml` is no log format; there are text and json\n";
    let run = |options: &[&str]| {
        let mut command = lamplight(["run", "--robots", "4", "--duration", "1", "--quiet"]);
        let command = command.args(options).arg(scenario("swarmbots"));
        let output = command.env("LAMPLIGHT_LOG", "xml").env("RUST_LOG", "arena=loud,coverage=off").output();
        let output = output.unwrap();
        assert!(output.status.success(), "{}", said(&output));
        stderr(&output).to_owned()
    };
    let filter = " WARN RUST_LOG: `arena=loud` is not understood; there are LEVEL and TARGET=LEVEL\n";
    for engine in ["processes", "in-process"] {
        assert_eq!(run(&["--engine", engine]), format!("{filter}{told}"));
    }
    let lines = objects(&run(&["--log", "json"]));
    assert_eq!(lines[1]["message"], told.trim().strip_prefix("WARN ").unwrap());
}

#[test]
fn a_filter_that_makes_no_sense_is_told_once_and_the_rest_counts() {
    let run = LiveRun::start_logging(
        "swarmbots",
        &["--robots", "4", "--duration", "1", "--quiet"],
        Some("warn,robot_agent=loud"),
    );
    let (output, _) = run.finish();
    assert!(output.status.success(), "{}", said(&output));
    let expected = " WARN RUST_LOG: `robot_agent=loud` is not understood; there are LEVEL and TARGET=LEVEL\n";
    assert_eq!(stderr(&output), expected);
}

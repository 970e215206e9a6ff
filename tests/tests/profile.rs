//! Measurements of agents in a run's results: everywhere the same, complete, and readable by others.

#![allow(clippy::unwrap_used, reason = "these are tests, helpers included")]

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use serde::Deserialize;
use serde_json::Value;
use tests::programs::{Run, lamplight, program, said, scenario};

/// The columns of `robots.csv` that come from measuring.
#[derive(Debug, Deserialize)]
struct Measured {
    robot: u32,
    packets_heard: u64,
    cycle_p50_us: Option<f64>,
    cycle_p99_us: Option<f64>,
    cycle_max_us: Option<f64>,
    wake_p50_us: Option<f64>,
    receive_p50_us: Option<f64>,
    neighbors_p50_us: Option<f64>,
    cell_p50_us: Option<f64>,
    truncation_p50_us: Option<f64>,
    centroid_p50_us: Option<f64>,
    step_p50_us: Option<f64>,
    publish_p50_us: Option<f64>,
    packet_p50_us: Option<f64>,
    packet_p99_us: Option<f64>,
    missed_deadlines: Option<u64>,
    cpu_ms: Option<f64>,
    switches_voluntary: Option<u64>,
    rss_kb: Option<u64>,
    pss_kb: Option<u64>,
}

/// One histogram of `latency.hlog`, as Python has read it.
#[derive(Debug, Deserialize)]
struct Histogram {
    count: u64,
    p50_us: f64,
    max_us: f64,
    seconds: f64,
}

/// A Python that can read interval logs: of `scripts/test`. `None` where there is no Python at all.
fn python() -> Option<PathBuf> {
    let has_python = Command::new("python3").arg("--version").output().is_ok();
    if !has_python {
        eprintln!("SKIPPED: there is no python3, so latency.hlog is not read back by it");
        return None;
    }
    let test = std::env::current_exe().unwrap();
    // A test lies in target/PROFILE/deps.
    let python = test.ancestors().nth(3).unwrap().join("python/bin/python3");
    assert!(python.exists(), "{} is missing: run scripts/test, which makes it", python.display());
    Some(python)
}

fn read_log(python: &Path, log: &Path) -> BTreeMap<String, Histogram> {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/read_hlog.py");
    let output = Command::new(python).arg(script).arg(log).output().unwrap();
    assert!(output.status.success(), "{}", said(&output));
    serde_json::from_slice(&output.stdout).unwrap()
}

fn agents(run: &Run) -> &Value {
    &run.summary["agents"]
}

#[test]
fn the_interval_log_says_the_same_as_summary_and_table() {
    let Some(python) = python() else { return };
    let run = Run::of("swarmbots", &["--robots", "12", "--duration", "20"]);
    let log = read_log(&python, &run.file("latency.hlog"));
    let (robots, agents) = (run.rows::<Measured>("robots.csv"), agents(&run));
    let close = |a: f64, b: f64| (a - b).abs() <= 0.02 * b.abs() + 0.001;

    // 200 ticks and tick 0; the last cycle has no end, and a first word no known origin.
    let (cycles, heard) = (12 * 200, robots.iter().map(|robot| robot.packets_heard).sum::<u64>());
    assert_eq!((log["cycle"].count, agents["cycles"].as_u64()), (cycles, Some(cycles)));
    assert_eq!(Some(log["packet"].count), agents["packets"].as_u64());
    assert_eq!(log["packet"].count + agents["packets_unknown"].as_u64().unwrap(), heard);
    assert!(agents["packets_unknown"].as_u64().unwrap() <= 12 * 11, "those of the first words");
    assert_eq!(agents["cycles_left_out"], 0);
    for (tag, spread) in [("cycle", &agents["cycle_us"]), ("packet", &agents["packet_latency_us"])]
        .into_iter()
        .chain(agents["stages_us"].as_object().unwrap().iter().map(|(name, spread)| (name.as_str(), spread)))
    {
        assert!(close(log[tag].p50_us, spread["p50"].as_f64().unwrap()), "{tag}: {spread}");
        assert!(close(log[tag].max_us, spread["max"].as_f64().unwrap()), "{tag}: {spread}");
    }
    let wall_time_s = run.number("wall_time_s");
    assert!((log["cycle"].seconds - wall_time_s).abs() < 0.2 + 0.1 * wall_time_s, "{:?}", log["cycle"]);

    for robot in &robots {
        let of = |span: &str| &log[&format!("robot={}.span={span}", robot.robot)];
        assert_eq!(of("cycle").count, 200);
        for (span, p50_us) in [
            ("cycle", robot.cycle_p50_us),
            ("wake", robot.wake_p50_us),
            ("receive", robot.receive_p50_us),
            ("neighbors", robot.neighbors_p50_us),
            ("cell", robot.cell_p50_us),
            ("truncation", robot.truncation_p50_us),
            ("centroid", robot.centroid_p50_us),
            ("step", robot.step_p50_us),
            ("publish", robot.publish_p50_us),
            ("packet", robot.packet_p50_us),
        ] {
            assert!(close(of(span).p50_us, p50_us.unwrap()), "{span} of {robot:?}");
        }
        assert!(close(of("cycle").max_us, robot.cycle_max_us.unwrap()), "{robot:?}");
        assert!(robot.cycle_p99_us <= robot.cycle_max_us && robot.packet_p50_us <= robot.packet_p99_us);
    }
}

#[test]
fn a_controller_without_stages_has_all_of_its_step_in_one() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("loud.toml");
    // Lines take it longer than any other part of a cycle.
    let text = format!(
        "duration_s = 2\nstep_s = 0.1\narena.size_m = [2, 2]\nrobots.count = 3\nchannel.range_m = 1\n\
         [[controller]]\nprogram = [{:?}]\nparams = {{ lines_per_step = 20 }}\n",
        program("scripted-agent")
    );
    fs::write(&file, text).unwrap();
    let out = folder.path().join("out");
    let output = lamplight(["run", "--quiet", "--out"]).arg(&out).arg(&file).output().unwrap();
    assert!(output.status.success(), "{}", said(&output));
    for robot in Run::in_folder(folder).rows::<Measured>("robots.csv") {
        let told =
            [robot.neighbors_p50_us, robot.cell_p50_us, robot.truncation_p50_us, robot.centroid_p50_us];
        assert_eq!(told, [Some(0.0); 4], "{robot:?}");
        assert!(robot.step_p50_us > Some(0.5 * robot.cycle_p50_us.unwrap()), "{robot:?}");
    }
}

#[test]
fn a_process_says_what_it_has_used() {
    let run = Run::of("swarmbots", &["--robots", "5", "--duration", "20"]);
    for robot in run.rows::<Measured>("robots.csv") {
        assert!(robot.cpu_ms.unwrap() > 0.0, "{robot:?}");
        // It slept between 201 ticks.
        assert!(robot.switches_voluntary.unwrap() >= 100, "{robot:?}");
        assert!(robot.rss_kb.unwrap() > 100, "{robot:?}");
        assert!(robot.pss_kb.is_none_or(|pss_kb| pss_kb <= robot.rss_kb.unwrap()), "{robot:?}");
    }
    let processes = &agents(&run)["processes"];
    assert_eq!(processes["count"], 5);
    assert!(processes["cpu_ms"].as_f64().unwrap() > 0.0, "{processes}");
}

#[test]
fn in_real_time_lateness_and_missed_deadlines_are_told() {
    let run = Run::of("swarmbots", &["--robots", "5", "--duration", "4", "--mode", "realtime"]);
    let agents = agents(&run);
    assert!(agents["stages_us"]["wake"]["p50"].as_f64().unwrap() > 0.0, "{agents}");
    assert!(agents["period_jitter_us"]["p99"].as_f64().unwrap() > 0.0, "{agents}");
    assert!(agents["packets"].as_u64().unwrap() > 0, "{agents}");
    for robot in run.rows::<Measured>("robots.csv") {
        assert!(robot.missed_deadlines.is_some() && robot.cycle_p50_us.is_some(), "{robot:?}");
    }
}

#[test]
fn the_killed_and_the_restarted_are_measured_as_long_as_they_live() {
    let plan = "fault=[{ kind = \"kill\", at_s = 5, restart_at_s = 10, robots = \"0\" }, \
                { kind = \"kill\", at_s = 5, robots = \"1\" }, \
                { kind = \"pause\", from_s = 5, until_s = 10, robots = \"2\" }]";
    let run = Run::of("swarmbots", &["--robots", "6", "--duration", "20", "--set", plan]);
    let robots = run.rows::<Measured>("robots.csv");
    assert!(robots[0].cpu_ms.is_some() && robots[0].cycle_p50_us.is_some());
    assert!(robots[1].cpu_ms.is_none() && robots[1].cycle_p50_us.is_some());
    assert!(robots[2].cpu_ms.is_some());
    let agents = agents(&run);
    assert_eq!((&agents["cycles_left_out"], &agents["processes"]["count"]), (&0.into(), &5.into()));
}

#[test]
fn a_run_goes_the_same_way_unmeasured_and_leaves_the_columns_empty() {
    let options = ["--robots", "12", "--duration", "20"];
    let measured = Run::of("swarmbots", &options);
    assert!(measured.file("latency.hlog").exists());
    for without in [&["--no-profile"][..], &["--engine", "in-process"]] {
        let run = Run::of("swarmbots", &[&options, without].concat());
        assert_eq!(run.digest(), measured.digest());
        assert_eq!(run.summary["agents"], Value::Null);
        assert!(!run.file("latency.hlog").exists());
        let robots = run.rows::<Measured>("robots.csv");
        assert!(robots.iter().all(|robot| robot.cycle_p50_us.is_none() && robot.cpu_ms.is_none()));
    }
}

#[test]
fn a_person_is_told_in_a_few_lines() {
    let output =
        lamplight(["run"]).arg(scenario("swarmbots")).args(["--duration", "2", "--quiet"]).output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    for beginning in ["agents: cycle ", "agents: CPU "] {
        assert_eq!(text.lines().filter(|line| line.starts_with(beginning)).count(), 1, "{text}");
    }
}

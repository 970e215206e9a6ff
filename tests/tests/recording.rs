//! Recordings of runs: what they hold, that it is what happened, and what is left of one that was cut.

#![allow(clippy::unwrap_used, reason = "these are tests, helpers included")]

use std::{
    fs::{self, File},
    path::Path,
    process::{Command, Output, Stdio},
};

use recording::{
    Reader, Topic,
    foxglove::{PosesInFrame, SceneUpdate},
    lamplight::Tick,
};
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;
use tests::{
    live::wait_until,
    programs::{interpreter, lamplight, program, recorded, said, scenario},
};

fn replay(file: &Path, args: &[&str]) -> Output {
    lamplight(["replay", "--quiet"]).args(args).arg(file).output().unwrap()
}

fn stdout(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

const PLAN: &str = r#"fault=[{ kind = "kill", at_s = 1, restart_at_s = 2, robots = "5-14" },
                             { kind = "pause", from_s = 1.5, until_s = 3, robots = "20-24" }]"#;

#[test]
fn a_recording_is_what_happened_whichever_engine_recorded_it() {
    let folder = tempfile::tempdir().unwrap();
    let args = ["--duration", "5", "--set", PLAN];
    let mut files = Vec::new();
    for engine in ["processes", "in-process"] {
        let (summary, file) =
            recorded(&folder, &scenario("swarmbots"), &[&args[..], &["--engine", engine]].concat());
        let verified = replay(&file, &["--verify"]);
        assert!(verified.status.success(), "{}", said(&verified));
        let digest = summary["digest"].as_str().unwrap();
        assert_eq!(stdout(&verified), format!("51 ticks are as recorded; digest {digest}\n"));
        let told = stdout(&replay(&file, &[]));
        assert!(
            told.contains("swarmbots: 50 robots, seed 1") && told.contains("ticks 0 to 50 of 50"),
            "{told}"
        );
        assert!(told.contains(&format!("the run finished; digest {digest}")), "{told}");
        files.push(file);
    }

    let mut entries = Reader::new(File::open(&files[0]).unwrap());
    let (mut ticks, mut poses, mut latest, mut scenes) = (0, 0, 0, Vec::new());
    while let Some(entry) = entries.next_entry().unwrap() {
        assert!(entry.time_ns >= latest, "in order of time");
        latest = entry.time_ns;
        match entry.topic {
            Topic::Ticks => {
                let tick: Tick = entry.message().unwrap();
                assert_eq!((tick.tick, entry.time_ns, tick.hashes.len()), (ticks, ticks * 100_000_000, 50));
                ticks += 1;
            }
            Topic::Robots => {
                let robots: PosesInFrame = entry.message().unwrap();
                let is_inside = |x: f64| (0.0..2.4384).contains(&x);
                let places = robots.poses.iter().map(|pose| pose.position.unwrap());
                assert!(
                    places.clone().count() == 50
                        && places.clone().all(|at| is_inside(at.x) && is_inside(at.y))
                );
                poses += 1;
            }
            Topic::Scene => scenes.push(entry.message::<SceneUpdate>().unwrap()),
            _ => {}
        }
    }
    assert_eq!((ticks, poses, entries.cut()), (51, 51, None));
    let shapes = |scene: &SceneUpdate| {
        let of = |id: &str| scene.entities.iter().find(|entity| entity.id == id);
        (of("bodies").map_or(0, |it| it.cylinders.len()), of("cells").map_or(0, |it| it.lines.len()))
    };
    // Walls and lamps first, then every half second; ten robots are down from 1 s to 2 s, five paused from 1.5 s to 3 s.
    assert_eq!(scenes.len(), 1 + 11);
    assert_eq!(scenes[0].entities.iter().map(|entity| entity.spheres.len()).sum::<usize>(), 2);
    let cells: Vec<_> = scenes[1..].iter().map(shapes).collect();
    let expected = [50, 50, 40, 35, 45, 45, 50, 50, 50, 50, 50].map(|cells| (50, cells));
    assert_eq!(cells, expected);
}

#[test]
fn lamps_are_shown_where_they_are_by_then() {
    let folder = tempfile::tempdir().unwrap();
    let faults = "fault=[{ kind = \"field\", at_s = 1, lamp = 0, position_m = [0.5, 0.25] }, { kind = \"field\", at_s = \
                  1.5, offset = 3 }]";
    let args = ["--duration", "2", "--engine", "in-process", "--set", faults];
    let (_, file) = recorded(&folder, &scenario("swarmbots"), &args);
    let verified = replay(&file, &["--verify"]);
    assert!(verified.status.success(), "{}", said(&verified));
    let mut entries = Reader::new(File::open(&file).unwrap());
    let mut shown = Vec::new();
    while let Some(entry) = entries.next_entry().unwrap() {
        if entry.topic == Topic::Scene {
            let scene = entry.message::<SceneUpdate>().unwrap();
            let lamps = scene.entities.iter().find(|entity| entity.id == "lamps");
            let at = lamps.map(|lamps| lamps.spheres[0].pose.as_ref().unwrap().position.unwrap());
            shown.extend(at.map(|at| (entry.time_ns, (at.x, at.y) == (0.5, 0.25))));
        }
    }
    assert_eq!(shown, [(0, false), (1_000_000_000, true)], "at first, and when they have changed");
}

#[test]
fn another_run_is_told_apart_with_tick_and_robot() {
    let folder = tempfile::tempdir().unwrap();
    let (_, file) = recorded(&folder, &scenario("swarmbots"), &["--duration", "2", "--engine", "in-process"]);
    let bytes = fs::read(&file).unwrap();
    // The ticks of another run behind the scenario of this one.
    let other = recorded(
        &folder,
        &scenario("swarmbots"),
        &["--duration", "2", "--engine", "in-process", "--seed", "2"],
    )
    .1;
    let swapped = folder.path().join("swapped.mcap");
    swap_scenario(&other, &file, &swapped);
    let output = replay(&swapped, &["--verify"]);
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    assert!(
        stdout(&output).starts_with("0 ticks are as recorded; in tick 0 robot 0 is another"),
        "{}",
        said(&output)
    );

    for (name, contents) in [("empty", &b""[..]), ("text", b"no recording at all"), ("begun", &bytes[..100])]
    {
        let path = folder.path().join(name);
        fs::write(&path, contents).unwrap();
        let output = replay(&path, &["--verify"]);
        assert_eq!(output.status.code(), Some(2), "{name}: {}", said(&output));
        assert!(said(&output).contains(name), "{}", said(&output));
    }
    let missing = replay(&folder.path().join("missing.mcap"), &[]);
    assert_eq!(missing.status.code(), Some(2));
    assert!(said(&missing).contains("cannot read "), "{}", said(&missing));
}

/// Writes the ticks of one recording behind the first message of another.
fn swap_scenario(ticks: &Path, scenario: &Path, to: &Path) {
    let mut writer = recording::Writer::new(File::create(to).unwrap()).unwrap();
    let mut first = Reader::new(File::open(scenario).unwrap());
    let run: recording::lamplight::Run = first.next_entry().unwrap().unwrap().message().unwrap();
    writer.write(Topic::Run, 0, &run).unwrap();
    let mut entries = Reader::new(File::open(ticks).unwrap());
    while let Some(entry) = entries.next_entry().unwrap() {
        if entry.topic == Topic::Ticks {
            writer.write(Topic::Ticks, entry.time_ns, &entry.message::<Tick>().unwrap()).unwrap();
        }
    }
    writer.finish().unwrap();
}

#[test]
fn a_run_that_is_killed_leaves_a_recording_that_can_be_verified() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let mut run =
        lamplight(["run", "--quiet", "--record", "--engine", "in-process", "--speed", "10", "--out"])
            .arg(&out)
            .arg(scenario("swarmbots"))
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
    let file = out.join("run.mcap");
    // Two flushes: one tick in ten milliseconds.
    let length = || file.metadata().map_or(0, |file| file.len());
    wait_until("a chunk is there", || length() > 60_000);
    let before = length();
    wait_until("another is there", || length() > before);
    kill_process(Pid::from_child(&run), Signal::KILL).unwrap();
    run.wait().unwrap();
    let output = replay(&file, &["--verify"]);
    assert!(output.status.success(), "{}", said(&output));
    let told = stdout(&output);
    let (ticks, how) = told.trim_end().split_once(" ticks are as recorded; ").unwrap();
    assert!(ticks.parse::<u64>().unwrap() > 10 && how == "the recording was cut there", "{told}");
    assert!(stdout(&replay(&file, &[])).contains("it was cut"));
}

#[test]
fn a_full_disk_ends_the_recording_and_not_the_run() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let output = Command::new("bash")
        .args(["-c", "ulimit -f 500; exec \"$@\"", "bash"])
        .arg(program("lamplight"))
        .args(["run", "--quiet", "--json", "--record", "--engine", "in-process", "--out"])
        .arg(&out)
        .arg(scenario("swarmbots"))
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    assert!(
        said(&output).contains("run.mcap: File too large")
            && said(&output).contains("the recording ends there"),
        "{}",
        said(&output)
    );
    let summary: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(summary["ended"], "finished");
    let verified = replay(&out.join("run.mcap"), &["--verify"]);
    assert!(verified.status.success(), "{}", said(&verified));
}

#[test]
fn a_run_of_programs_is_verified_as_processes() {
    if !Command::new("node").arg("--version").output().is_ok_and(|output| output.status.success()) {
        eprintln!("SKIPPED: there is no node");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("s.toml");
    let text = "duration_s = 1\nstep_s = 0.1\narena.size_m = [2, 2]\nrobots.count = 3\nchannel.range_m = 3\n\
                processes.hang_timeout_s = 60\n[controller]\nprogram = [\"node\", \"mind.js\"]\nspeaks = \"json-lines\"\n";
    fs::write(&path, text).unwrap();
    let mind = |speed: f64| {
        let text = format!(
            "const lines = require('readline').createInterface({{ input: process.stdin }});\n\
             lines.on('line', (line) => {{\n  const {{ tick }} = JSON.parse(line);\n  \
             console.log(JSON.stringify(tick === undefined ? {{}} : {{ tick, velocity: [tick < 5 ? 0 : {speed}, 0] }}));\n}});\n"
        );
        fs::write(folder.path().join("mind.js"), text).unwrap();
    };
    mind(0.1);
    let (summary, file) = recorded(&folder, &path, &[]);
    let same = replay(&file, &["--verify"]);
    assert!(same.status.success(), "{}", said(&same));
    let digest = summary["digest"].as_str().unwrap();
    assert_eq!(stdout(&same), format!("11 ticks are as recorded; digest {digest}\n"));
    mind(0.2);
    let other = replay(&file, &["--verify"]);
    assert_eq!(other.status.code(), Some(1), "{}", said(&other));
    assert_eq!(stdout(&other), "6 ticks are as recorded; in tick 6 robot 0 is another than was recorded\n");
}

#[test]
fn the_package_of_others_reads_it_whole_and_cut() {
    let Some(python) = interpreter() else { return };
    let folder = tempfile::tempdir().unwrap();
    let (_, file) =
        recorded(&folder, &scenario("swarmbots"), &["--duration", "60", "--engine", "in-process"]);
    let script = r#"
import io, sys
from mcap.reader import make_reader
from mcap.stream_reader import StreamReader
from mcap.records import Message
from mcap_protobuf.decoder import DecoderFactory

data = open(sys.argv[1], "rb").read()
reader = make_reader(io.BytesIO(data), decoder_factories=[DecoderFactory()])
counts, robots, latest = {}, set(), 0
for schema, channel, message, decoded in reader.iter_decoded_messages(log_time_order=False):
    assert message.log_time >= latest
    latest = message.log_time
    counts[channel.topic] = counts.get(channel.topic, 0) + 1
    if channel.topic == "/robots":
        robots.add(len(decoded.poses))
    if channel.topic == "/robots/points":
        assert len(decoded.data) == 50 * decoded.point_stride
assert robots == {50} and counts["/robots"] == counts["/ticks"] == 601 and counts["/end"] == 1, counts

cut, found = io.BytesIO(data[: len(data) // 2]), 0
try:
    for record in StreamReader(cut).records:
        found += isinstance(record, Message)
except Exception as error:
    print(type(error).__name__)
assert found > 600, found
print("read")
"#;
    let output = Command::new(python).args(["-c", script]).arg(&file).output().unwrap();
    assert!(output.status.success() && stdout(&output).ends_with("read\n"), "{}", said(&output));
}

#[test]
fn what_cannot_be_recorded_or_verified_is_said() {
    let output = lamplight(["run", "--record"]).arg(scenario("swarmbots")).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(said(&output).contains("--out"), "{}", said(&output));
    let folder = tempfile::tempdir().unwrap();
    let (_, file) = recorded(&folder, &scenario("swarmbots"), &["--duration", "1", "--mode", "realtime"]);
    let output = replay(&file, &["--verify"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(said(&output).contains("was recorded in real time"), "{}", said(&output));
}

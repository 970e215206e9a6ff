//! Controllers in Python: a process for each robot, or one loop, with equal digests; and what they do wrong.

#![allow(clippy::unwrap_used, reason = "these are tests, helpers included")]

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Output, Stdio},
    thread,
    time::Duration,
};

use rustix::process::{Pid, Signal, kill_process};
use serde_json::{Value, json};
use tempfile::TempDir;
use tests::{
    live::{descendants, wait_until},
    programs::{interpreter, lamplight, program, said},
};

/// Twelve robots that a file beside this one thinks for; every sensor is granted.
const SCENARIO: &str = r#"
duration_s = 4
step_s = 0.1
arena = { size_m = [2, 2], boundary_sensing = true }
robots.count = 12
channel = { range_m = 1, payload_bytes_max = 40 }
sensors = { odometry = true, compass = true, position = true }
controller.python = "my.py"

[[field.lamp]]
position_m = [1.5, 1]
peak = 500
half_distance_m = 0.5
"#;

/// Drives towards the light, and at tick 7 does what its params say, if it is the robot that they name.
const CONTROLLER: &str = r#"
import ctypes, os, sys, threading, time
from lamplight import Command, Controller

class ToTheLight(Controller):
    def __init__(self, what="nothing", who=3):
        self.what, self.who, self.heap = what, who, []
        if what == "is_never_made" and self.robot == who:
            raise ValueError("not today")

    def step(self, percept):
        command = Command(velocity=0.1 * percept.light.direction, payload=b"%d" % percept.tick)
        if percept.tick == 7 and self.robot == self.who and self.life == 1:
            return getattr(self, self.what)() or command
        return command

    def nothing(self): pass
    def raises(self): raise ValueError("it is dark")
    def stops(self): raise SystemExit(5)
    def returns_nonsense(self): return 3
    def returns_nan(self): return Command(velocity=(float("nan"), 0))
    def says_too_much(self): return Command(payload=b"x" * 129)
    def exits(self): os._exit(7)
    def hangs(self): time.sleep(1000)
    def leaks(self):
        while True: self.heap.append(bytearray(10000000))
    def prints(self):
        for line in range(20000): print("much", line)
    def forks(self):
        if os.fork() == 0: time.sleep(1000)
    def starts_threads(self):
        for _ in range(5): threading.Thread(target=time.sleep, args=(1000,), daemon=True).start()
"#;

/// A folder with the scenario and a controller.
fn folder(controller: &str) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("s.toml"), SCENARIO).unwrap();
    fs::write(folder.path().join("my.py"), controller).unwrap();
    folder
}

fn run(folder: &Path, args: &[&str]) -> Output {
    lamplight(["run", "s.toml", "--quiet", "--json"]).args(args).current_dir(folder).output().unwrap()
}

/// Processes with a file of `folder` on their command line, as fork servers and their agents have it.
fn processes_of(folder: &Path) -> usize {
    let entries = fs::read_dir("/proc").unwrap().flatten();
    let lines = entries.filter_map(|entry| fs::read_to_string(entry.path().join("cmdline")).ok());
    lines
        .filter(|line| line.contains(folder.to_str().unwrap()) && line.contains("lamplight.fork_server"))
        .count()
}

fn summary(output: &Output) -> Value {
    assert!(output.status.success(), "{}", said(output));
    serde_json::from_slice(&output.stdout).unwrap()
}

fn played(folder: &Path, args: &[&str]) -> Value {
    summary(&run(folder, args))
}

#[test]
fn processes_and_one_loop_have_one_digest_under_faults_too() {
    if interpreter().is_none() {
        return;
    }
    let folder = folder(CONTROLLER);
    let plan = r#"fault=[{ kind = "kill", at_s = 1, restart_at_s = 2, robots = "0-3" },
                         { kind = "pause", from_s = 1.5, until_s = 2.5, robots = "4-6" },
                         { kind = "kill", at_s = 3, robots = [7] }]"#;
    for args in [&[][..], &["--set", plan], &["--set", "channel.loss=0.4", "--set", plan]] {
        let processes = played(folder.path(), args);
        let in_process = played(folder.path(), &[args, &["--engine", "in-process"]].concat());
        assert_eq!(processes["digest"], in_process["digest"], "{args:?}");
        assert_eq!(processes["incidents"], json!([]));
        assert_eq!(played(folder.path(), args)["digest"], processes["digest"]);
    }
}

/// The tick from which on a robot is left out, by what is told of it.
fn left_out_from(summary: &Value) -> u64 {
    let what = summary["incidents"][0]["what"].as_str().unwrap();
    let (_, rest) = what.split_once("it is left out from tick ").unwrap();
    rest.strip_suffix(" on").unwrap().parse().unwrap()
}

#[test]
fn whatever_a_controller_does_wrong_costs_it_alone_and_is_named() {
    if interpreter().is_none() {
        return;
    }
    let folder = folder(CONTROLLER);
    let killed = |tick: u64| {
        let plan = format!(r#"fault=[{{ kind = "kill", at_s = {}, robots = [3] }}]"#, tick as f64 / 10.0);
        played(folder.path(), &["--set", &plan])["digest"].clone()
    };
    let cases = [
        ("raises", "its step raised ValueError: it is dark"),
        ("stops", "its step raised SystemExit: 5"),
        ("returns_nonsense", "step must return a lamplight.Command, and returned int"),
        ("returns_nan", "its velocity is (NaN, 0), not within ±1e12"),
        ("says_too_much", "a payload of 129 bytes is longer than any packet's"),
        ("leaks", "its step raised MemoryError"),
        ("exits", "exit status 7"),
        ("hangs", "has not answered tick 7 for 1s"),
    ];
    for (what, words) in cases {
        let params = format!("controller.params.what={what}");
        // Only who hangs is not waited for: under load others may take their time.
        let patience = if what == "hangs" { "1" } else { "60" };
        let patience = format!("processes.hang_timeout_s={patience}");
        let limits = ["--set", "processes.memory_max_mb=500", "--set", &patience];
        let output = run(folder.path(), &[&["--set", &params], &limits[..]].concat());
        let told = said(&output);
        assert!(told.contains(words) && told.contains("robot 3"), "{what}: {told}");
        let left = summary(&output);
        assert_eq!((&left["robots_alive"], left["incidents"].as_array().unwrap().len()), (&json!(11), 1));
        assert_eq!(left["incidents"][0]["tick"], 7);
        assert_eq!(left["digest"], killed(left_out_from(&left)), "{what}");
        if ["leaks", "exits", "hangs"].contains(&what) {
            continue;
        }
        for policy in ["exclude", "restart"] {
            let policy = format!("processes.on_hang={policy}");
            let args = ["--set", &params, "--set", &policy];
            let in_process = played(folder.path(), &[&args[..], &["--engine", "in-process"]].concat());
            let processes = played(folder.path(), &args);
            assert_eq!(in_process["digest"], processes["digest"], "{what} {policy}");
            assert_eq!(in_process["robots_alive"], processes["robots_alive"], "{what} {policy}");
        }
    }
}

#[test]
fn a_controller_that_cannot_be_made_costs_its_own_robot_in_either_engine() {
    if interpreter().is_none() {
        return;
    }
    let folder = folder(CONTROLLER);
    let never = ["--set", "controller.params.what=is_never_made"];
    for policy in ["exclude", "restart"] {
        let policy = format!("processes.on_hang={policy}");
        let args = [&never[..], &["--set", &policy]].concat();
        let in_process = run(folder.path(), &[&args[..], &["--engine", "in-process"]].concat());
        assert!(said(&in_process).contains("robot 3") && said(&in_process).contains("not today"));
        let (in_process, processes) = (summary(&in_process), played(folder.path(), &args));
        assert_eq!((&in_process["robots_alive"], &processes["robots_alive"]), (&json!(11), &json!(11)));
        assert_eq!(in_process["digest"], processes["digest"], "{policy}");
    }
    let all = ["--set", "controller.params.whom=3"];
    for engine in ["processes", "in-process"] {
        let output = run(folder.path(), &[&all[..], &["--engine", engine]].concat());
        assert!(!output.status.success(), "{engine}");
        assert!(said(&output).contains("unexpected keyword argument 'whom'"), "{engine}: {}", said(&output));
    }
}

#[test]
fn two_runs_may_share_a_script() {
    if interpreter().is_none() {
        return;
    }
    let folder = folder(CONTROLLER);
    let started = || {
        lamplight(["run", "s.toml", "--quiet", "--json"])
            .current_dir(folder.path())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap()
    };
    let both = [started(), started()].map(|run| summary(&run.wait_with_output().unwrap()));
    assert_eq!(both[0]["digest"], both[1]["digest"]);
    assert_eq!((&both[0]["incidents"], &both[1]["incidents"]), (&json!([]), &json!([])));
}

#[test]
fn an_interpreter_that_lacks_something_is_named_with_what_to_do() {
    if interpreter().is_none() {
        return;
    }
    let (folder, without) = (folder(CONTROLLER), tempfile::tempdir().unwrap());
    let module = "raise ModuleNotFoundError(\"No module named 'numpy'\", name='numpy')\n";
    fs::write(without.path().join("numpy.py"), module).unwrap();
    for engine in ["processes", "in-process"] {
        let run = || {
            let mut run = lamplight(["run", "s.toml", "--quiet", "--engine", engine]);
            run.current_dir(folder.path());
            run
        };
        let output = run().env("PYTHONPATH", without.path()).output().unwrap();
        assert!(!output.status.success() && said(&output).contains("numpy"), "{engine}: {}", said(&output));
        // One that is sure not to have it.
        let output = run().env("LAMPLIGHT_PYTHON", "python3").env("PYTHONPATH", "").output().unwrap();
        assert_eq!(output.status.code(), Some(2), "{}", said(&output));
        assert!(said(&output).contains("hint: install the package lamplight in it"), "{}", said(&output));
    }
}

#[test]
fn what_a_controller_may_do_changes_nothing_and_leaves_nothing() {
    if interpreter().is_none() {
        return;
    }
    let folder = folder(CONTROLLER);
    let expected = played(folder.path(), &[])["digest"].clone();
    for what in ["prints", "forks", "starts_threads"] {
        let output = run(folder.path(), &["--set", &format!("controller.params.what={what}")]);
        assert_eq!(summary(&output)["digest"], expected, "{what}");
        let printed = String::from_utf8_lossy(&output.stderr).matches("robot 3: much ").count();
        assert_eq!(printed, if what == "prints" { 20_000 } else { 0 });
        assert_eq!(processes_of(folder.path()), 0, "{what}");
    }
}

#[test]
fn a_percept_has_what_is_granted_as_arrays_that_are_views() {
    if interpreter().is_none() {
        return;
    }
    let controller = r#"
import sys
import numpy
from lamplight import Command, Controller

class Looks(Controller):
    def step(self, percept):
        if percept.tick == 20 and self.robot == 0:
            neighbors = percept.neighbors
            assert neighbors.dtype.names == ("range_m", "bearing_rad", "orientation_rad", "sender", "age_cycles")
            assert 2 < len(neighbors) == len(percept.payloads), neighbors
            assert not neighbors.flags.owndata and not neighbors.flags.writeable
            assert percept.neighbors is neighbors, "it is made once"
            assert (numpy.diff(neighbors["sender"].astype(int)) > 0).all() and (neighbors["age_cycles"] == 0).all()
            assert percept.payloads[0] == b"%d says" % neighbors["sender"][0], percept.payloads
            assert len(percept.walls) == 4 and percept.walls["distance_m"].min() >= 0
            place = (percept.position.x_m, percept.position.y_m)
            assert all(0 < it < 2 for it in place), place
            assert percept.compass.heading_rad == percept.odometry.heading_rad + self.began
            assert percept.light.gradient.shape == (2,) and percept.light.value > 0
            kept = neighbors["range_m"][0]
            self.kept, self.value = neighbors, kept
            try:
                neighbors["range_m"][0] = 1
            except ValueError:
                print("all is well")
        if percept.tick == 0:
            self.began = percept.compass.heading_rad
        if percept.tick == 21 and self.robot == 0:
            assert self.kept["range_m"][0] == self.value, "what has been kept stays as it was"
        return Command(payload=b"%d says" % self.robot)
"#;
    let folder = folder(controller);
    let output = run(folder.path(), &[]);
    let left = summary(&output);
    assert_eq!((&left["incidents"], &left["robots_alive"]), (&json!([]), &json!(12)), "{}", said(&output));
    assert!(said(&output).contains("robot 0: all is well"), "{}", said(&output));
    let lonely = played(folder.path(), &["--engine", "in-process"]);
    assert_eq!(lonely["digest"], left["digest"]);
}

#[test]
fn showing_neighbors_takes_no_memory_for_each() {
    if interpreter().is_none() {
        return;
    }
    let controller = r#"
import sys
from lamplight import Command, Controller

class Counts(Controller):
    def step(self, percept):
        before = sys.getallocatedblocks()
        neighbors = percept.neighbors
        blocks = sys.getallocatedblocks() - before
        if percept.tick >= 20 and percept.tick % 5 == 0:
            print(f"{len(neighbors)} neighbors, {blocks} blocks")
        return Command()
"#;
    let folder = folder(controller);
    let output = run(folder.path(), &["--robots", "80", "--set", "channel.range_m=0.4"]);
    assert!(output.status.success(), "{}", said(&output));
    let text = String::from_utf8(output.stderr).unwrap();
    let counts = text.lines().filter_map(|line| {
        let (_, told) = line.split_once(": ")?;
        let (neighbors, rest) = told.split_once(" neighbors, ")?;
        Some((neighbors.parse::<u32>().ok()?, rest.strip_suffix(" blocks")?.parse::<u32>().ok()?))
    });
    let counts: Vec<(u32, u32)> = counts.collect();
    let (fewest, most) = (counts.iter().min().unwrap(), counts.iter().max().unwrap());
    assert!(fewest.0 + 5 < most.0, "{fewest:?} {most:?}");
    assert!(counts.iter().all(|(_, blocks)| *blocks < 10), "{counts:?}");
}

#[test]
fn a_file_without_one_controller_is_told_in_a_line_and_starts_nothing() {
    if interpreter().is_none() {
        return;
    }
    let two = "from lamplight import Controller\nclass A(Controller): pass\nclass B(Controller): pass\n";
    let cases = [
        ("x = 1\n", "my.py", "there is no class derived from lamplight.Controller in my.py"),
        (two, "my.py", "there is more than one controller in my.py: name one of them (there is A, B)"),
        (two, "my.py:C", "there is no class `C` in my.py (there is A, B)"),
        ("class D: pass\n", "my.py:D", "`D` in my.py is no class derived from lamplight.Controller"),
        ("def f(:\n", "my.py", "my.py, line 1: "),
        ("import no_such_package\n", "my.py", "my.py needs the package `no_such_package`, which "),
        ("1 / 0\n", "my.py", "my.py cannot be imported: ZeroDivisionError: division by zero"),
        ("import os\nos._exit(3)\n", "my.py", " ended before it had read "),
        ("", "other.py:E", "other.py of robots 0-11 cannot be read: No such file"),
    ];
    for (text, named, expected) in cases {
        let folder = folder(text);
        for engine in ["processes", "in-process"] {
            if text.contains("_exit") && engine == "in-process" {
                continue;
            }
            let output = run(folder.path(), &["--controller", named, "--engine", engine]);
            assert!(!output.status.success());
            let told = said(&output);
            assert!(told.contains(expected), "{named} {engine}: {told}");
        }
    }
}

#[test]
fn a_file_that_asks_for_a_run_when_it_is_imported_is_told_what_to_do_and_starts_none() {
    let Some(python) = interpreter() else { return };
    let call = "run('s.toml', controller=Still, duration=1, robots=2, out='out')";
    let text = |call: &str| {
        format!(
            "from lamplight import Command, Controller, run\nclass Still(Controller):\n    def step(self, percept):\n        \
             return Command()\n{call}\n"
        )
    };
    let folder = folder(&text(call));
    for engine in ["processes", "in-process"] {
        let output = run(folder.path(), &["--engine", engine]);
        assert!(!output.status.success(), "{engine}");
        assert!(said(&output).contains("put it under if __name__ == \"__main__\":"), "{}", said(&output));
        assert!(!folder.path().join("out").exists(), "{engine}");
    }
    fs::write(folder.path().join("my.py"), text(&format!("if __name__ == '__main__':\n    {call}"))).unwrap();
    let as_script = Command::new(python).arg("my.py").current_dir(folder.path()).output().unwrap();
    assert!(as_script.status.success() && folder.path().join("out").exists(), "{}", said(&as_script));
    played(folder.path(), &[]);
}

#[test]
fn what_robots_say_is_in_the_digest_though_nobody_moves() {
    if interpreter().is_none() {
        return;
    }
    let controller = "from lamplight import Command, Controller\nclass Says(Controller):\n    def __init__(self, what=1): \
                      self.what = what\n    def step(self, percept): return Command(payload=bytes([7] * self.what))\n";
    let folder = folder(controller);
    let digest = |what: &str, engine: &str| {
        let what = format!("controller.params.what={what}");
        played(folder.path(), &["--duration", "1", "--set", &what, "--engine", engine])["digest"].clone()
    };
    // As long as packets have room for, and longer.
    for what in ["1", "2", "30"] {
        assert_eq!(digest(what, "processes"), digest(what, "in-process"), "{what}");
    }
    assert_ne!(digest("1", "in-process"), digest("2", "in-process"));
    assert_ne!(digest("30", "in-process"), digest("31", "in-process"));
}

#[test]
fn a_controller_that_raises_is_a_failure_to_fuzz_told_once() {
    if interpreter().is_none() {
        return;
    }
    let folder = folder(CONTROLLER);
    let raises = ["--set", "controller.params.what=raises", "--set", "fuzz.kinds=[\"sensor\"]"];
    let output = lamplight(["fuzz", "s.toml", "--runs", "3", "--engine", "in-process", "--out", "failed"])
        .args(raises)
        .current_dir(folder.path())
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(1));
    let told = said(&output);
    let cause =
        "failed: tick 7: robot 3 died before it answered tick 7 (its step raised ValueError: it is dark)";
    assert!(told.contains(cause), "{told}");
    assert_eq!(told.matches("Traceback").count(), 1, "{told}");
    assert!(told.contains("--until 'incidents.0.tick >= 0'"), "{told}");
    let mut failed = fs::read_dir(folder.path().join("failed")).unwrap();
    let failed = failed.next().unwrap().unwrap().path();
    let shrunk = lamplight(["shrink", "--until", "incidents.0.tick >= 0", "--quiet"])
        .arg(&failed)
        .current_dir(folder.path())
        .output()
        .unwrap();
    assert!(shrunk.status.success(), "{}", said(&shrunk));
    let saved = format!("saved as {}-shrunk.toml", failed.file_stem().unwrap().display());
    assert!(said(&shrunk).contains("0 of ") && said(&shrunk).contains(&saved), "{}", said(&shrunk));
}

#[test]
fn a_run_is_not_that_of_another_file_with_the_same_name() {
    if interpreter().is_none() {
        return;
    }
    let folder = folder(CONTROLLER);
    let out = folder.path().join("out");
    let first = played(folder.path(), &["--out", "out"]);
    let again = |args: &[&str]| {
        lamplight(["run", "scenario.toml", "--quiet", "--json"])
            .args(args)
            .current_dir(&out)
            .output()
            .unwrap()
    };
    assert_eq!(summary(&again(&[]))["digest"], first["digest"]);
    fs::write(folder.path().join("my.py"), CONTROLLER.replace("0.1 *", "0.2 *")).unwrap();
    let output = again(&[]);
    assert_eq!(output.status.code(), Some(2));
    assert!(said(&output).contains("is another one: its SHA-256 is "), "{}", said(&output));
    assert_ne!(summary(&again(&["--set", "controller.sha256="]))["digest"], first["digest"]);
}

#[test]
fn a_script_runs_and_repeats_itself_with_a_class_of_its_own() {
    let Some(python) = interpreter() else { return };
    let folder = folder(CONTROLLER);
    let script = r#"
import lamplight
from lamplight import Command, Controller, RunError, batch, run

class ToTheLight(Controller):
    def __init__(self, speed=0.1):
        self.speed = speed

    def step(self, percept):
        return Command(velocity=self.speed * percept.light.direction, payload=b"%d" % percept.tick)

result = run("s.toml", controller=ToTheLight, robots=12)
same = run("s.toml", controller=ToTheLight, params={"speed": 0.1}, engine="in-process")
other = run("s.toml", controller={range(6): ToTheLight}, settings={"controller.0.params.what": "nothing"}, seed=1)
assert result.digest == same.digest, (result, same)
assert len(result.metrics) == 5 and len(result.robots) == 12
assert result.summary["robots"] == 12

import sys
import numpy
import pandas
assert isinstance(result.metrics, pandas.DataFrame), type(result.metrics)
kept, sys.modules["pandas"] = sys.modules["pandas"], None
metrics = result.metrics
assert isinstance(metrics, numpy.ndarray) and metrics["time_s"].tolist() == [0, 1, 2, 3, 4], metrics
assert numpy.isnan(metrics["mean_error_m"]).all(), "a controller that estimates no error has none"
plain = batch("s.toml", controller=ToTheLight, trials=1, sweep={"channel.loss": [0, 0.5]}, out="plain")
assert plain["channel.loss"].tolist() == [0, 0.5] and numpy.isnan(plain["mean_below_1e-3_s"]).all(), plain
sys.modules["pandas"] = kept

rows = batch("s.toml", controller=ToTheLight, trials=2, sweep={"channel.loss": [0, 0.5]}, out="batch", quiet=True)
assert len(rows) == 4
again = batch("s.toml", controller="my.py:ToTheLight", trials=2, sweep={"channel.loss": [0, 0.5]}, out="other")
assert again["digest"].tolist() == rows["digest"].tolist()

def refused(call, words):
    try:
        call()
    except (RunError, TypeError) as error:
        assert words in str(error), error
        return error
    assert False, words

assert refused(lambda: run("missing.toml", controller=ToTheLight), "missing.toml: no such file").status == 2
refused(lambda: run("my.py"), "my.py: is a file of Python, not a scenario")
refused(lambda: run("s.toml", controller="mine.py:It"), "relative to the folder that you are in")
refused(lambda: run("s.toml", controller="my.It"), "is named FILE.py:CLASS")
refused(lambda: run("s.toml", options="--speed 1"), "options must be a list of words")
refused(lambda: batch("s.toml", out="odd", sweep={"channel.loss": 0.3}), "sweep: channel.loss needs a list of values")
refused(lambda: Command(payload="hi"), 'a payload must be bytes, such as "hi".encode(), not str')
refused(lambda: lamplight.always("one leader", True), "the condition comes first, then a name")
print("done", result.digest)
"#;
    fs::write(folder.path().join("script.py"), script).unwrap();
    let output = Command::new(python).arg("script.py").current_dir(folder.path()).output().unwrap();
    assert!(output.status.success(), "{}", said(&output));
    let expected = played(folder.path(), &[])["digest"].as_str().unwrap().to_owned();
    assert_eq!(String::from_utf8(output.stdout).unwrap(), format!("done {expected}\n"));
}

#[test]
fn an_agent_can_be_started_by_hand() {
    let Some(python) = interpreter() else { return };
    let folder = folder(CONTROLLER);
    let name = format!("test-python-hand-{}", std::process::id());
    let command = lamplight(["run", "s.toml", "--quiet", "--json", "--by-hand", "5", "--name", &name])
        .current_dir(folder.path())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let start = || {
        Command::new(&python)
            .args(["-m", "lamplight.agent", "my.py:ToTheLight", "--run", &name, "--robot", "5"])
            .current_dir(folder.path())
            .stderr(Stdio::null())
            .spawn()
            .unwrap()
    };
    let mut agent = start();
    // It may come before there is a run to join.
    while agent.try_wait().unwrap().is_some_and(|status| !status.success()) {
        thread::sleep(Duration::from_millis(100));
        agent = start();
    }
    let output = command.wait_with_output().unwrap();
    assert!(agent.wait().unwrap().success());
    assert_eq!(summary(&output)["digest"], played(folder.path(), &[])["digest"]);
}

#[test]
fn nothing_is_left_when_the_supervisor_is_killed_though_a_controller_hangs() {
    if interpreter().is_none() {
        return;
    }
    let folder = folder(CONTROLLER);
    let name = format!("test-python-killed-{}", std::process::id());
    let patience = ["--set", "processes.hang_timeout_s=1000", "--set", "controller.params.what=hangs"];
    let mut supervisor = lamplight(["run", "s.toml", "--quiet", "--name", &name])
        .args(patience)
        .current_dir(folder.path())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    // And what they have been forked from.
    wait_until("all agents are there", || processes_of(folder.path()) == 13);
    thread::sleep(Duration::from_millis(500));
    let all = descendants(Pid::from_child(&supervisor));
    let names: Vec<String> = all
        .iter()
        .filter_map(|pid| fs::read_to_string(format!("/proc/{}/comm", pid.as_raw_pid())).ok())
        .collect();
    assert!((0..12).all(|robot| names.contains(&format!("robot-{robot}\n"))), "{names:?}");
    assert!(all.len() >= 14, "12 agents, an arena and a fork server: {all:?}");
    kill_process(Pid::from_child(&supervisor), Signal::KILL).unwrap();
    supervisor.wait().unwrap();
    wait_until("all have ended", || {
        all.iter().all(|pid| !PathBuf::from(format!("/proc/{}", pid.as_raw_pid())).exists())
    });
    assert!(Command::new(program("lamplight")).arg("clean").status().unwrap().success());
}

#[test]
fn random_plans_fit_controllers_of_any_kind_and_both_engines_agree_on_them() {
    if interpreter().is_none() {
        return;
    }
    let folder = folder(CONTROLLER);
    let output = lamplight(["fuzz", "s.toml", "--runs", "12", "--engine", "both", "--quiet"])
        .current_dir(folder.path())
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", said(&output));
    let shrunk =
        lamplight(["shrink", "s.toml", "--until", "robots_alive < 12", "--out", "small.toml", "--quiet"])
            .args([
                "--set",
                "fault=[{ kind = \"kill\", at_s = 1, robots = [1] }, { kind = \"loss\", probability = 0.1 }]",
            ])
            .current_dir(folder.path())
            .output()
            .unwrap();
    assert!(shrunk.status.success(), "{}", said(&shrunk));
    let small = fs::read_to_string(folder.path().join("small.toml")).unwrap();
    assert!(small.contains("count = 1\n") && small.contains("my.py"), "{small}");
}

//! Properties that controllers state, and what runs, `lamplight fuzz` and `lamplight shrink` make of them.

#![allow(clippy::unwrap_used, reason = "these are tests, helpers included")]

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Output},
};

use serde_json::{Value, json};
use tempfile::TempDir;
use tests::programs::{interpreter, lamplight, said};

/// Robots that state something in the constructor, at boot, at each step and in the step that they raise in.
const CONTROLLER: &str = r#"
import lamplight
from lamplight import Command, Controller

class Stating(Controller):
    def __init__(self):
        lamplight.sometimes(self.life > 1, "born again")

    def boot(self):
        lamplight.sometimes(True, "booted")
        return Command()

    def step(self, percept):
        lamplight.always(percept.tick != 4 or self.robot != 2, "calm")
        lamplight.always(len(percept.neighbors) >= 0, "held")
        lamplight.sometimes(percept.tick > 1000, "late")
        if self.robot == 1 and percept.tick == 6:
            lamplight.always(False, "last words")
            raise ValueError("no more")
        return Command()
"#;

const SCENARIO: &str = "duration_s = 2\nstep_s = 0.1\narena.size_m = [2, 2]\nrobots.count = 4\nchannel.range_m = 3\n\
                        [processes]\non_hang = \"exclude\"\n";

fn folder(controller: &str) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("s.toml"), SCENARIO.to_owned() + controller).unwrap();
    folder
}

fn in_folder(folder: &Path, words: &[&str]) -> Output {
    lamplight(words).current_dir(folder).output().unwrap()
}

fn stdout(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

fn summary(output: &Output) -> Value {
    assert!(output.status.success(), "{}", said(output));
    serde_json::from_slice(&output.stdout).unwrap()
}

fn example(file: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/consensus").join(file)
}

#[test]
fn every_engine_tells_which_robot_was_first_in_which_life() {
    if interpreter().is_none() {
        return;
    }
    let folder = folder("[controller]\npython = \"my.py\"\n");
    fs::write(folder.path().join("my.py"), CONTROLLER).unwrap();
    let plan = r#"fault=[{ kind = "kill", at_s = 0.8, restart_at_s = 1.2, robots = "0" }]"#;
    let run = |more: &[&str]| {
        let words = [&["run", "s.toml", "--quiet", "--set", plan], more].concat();
        in_folder(folder.path(), &words)
    };
    let told = summary(&run(&["--json"]));
    let first =
        |robot: u32, life: u32, tick: Option<u64>| json!({ "robot": robot, "life": life, "tick": tick });
    assert_eq!(
        told["always"],
        json!({
            "calm": { "robots": 4, "broken_by": 1, "first": first(2, 1, Some(4)) },
            "held": { "robots": 4, "broken_by": 0, "first": null },
            "last words": { "robots": 1, "broken_by": 1, "first": first(1, 1, Some(6)) },
        })
    );
    assert_eq!(
        told["sometimes"],
        json!({
            "booted": { "robots": 4, "reached_by": 4, "first": first(0, 1, None) },
            "born again": { "robots": 4, "reached_by": 1, "first": first(0, 2, None) },
            "late": { "robots": 4, "reached_by": 0, "first": null },
        })
    );
    let in_process = summary(&run(&["--json", "--engine", "in-process"]));
    for key in ["digest", "always", "sometimes"] {
        assert_eq!(in_process[key], told[key], "{key}");
    }

    let text = run(&[]);
    assert!(text.status.success(), "what is broken is told, and the run goes on: {}", said(&text));
    for line in [
        "always \"calm\": broken by 1 of 4 robots, first by robot 2 at tick 4",
        "always \"held\": held, stated by 4 robots",
        "sometimes \"born again\": reached by 1 of 4 robots, first by robot 0 (life 2) at the beginning of its life",
        "sometimes \"late\": not reached, stated by 4 robots",
    ] {
        assert!(stdout(&text).lines().any(|told| told == line), "{line}: {}", said(&text));
    }
    let strict = run(&["--strict-properties", "--engine", "in-process"]);
    assert_eq!(strict.status.code(), Some(1));
    assert!(said(&strict).contains("2 of 3 that must always hold did not"), "{}", said(&strict));
}

/// Robots that state something and then end, each in its way: in their second lives, and one in its third step.
const ENDING: &str = r#"
import os
import lamplight
from lamplight import Command, Controller

class Ending(Controller):
    def __init__(self, exits=False):
        self.exits = exits
        lamplight.always(self.life == 1 or self.robot != 1, "made")
        if self.life > 1 and self.robot == 1:
            raise ValueError("in __init__")

    def boot(self):
        lamplight.always(self.life == 1 or self.robot != 2, "booted")
        if self.life > 1 and self.robot == 2:
            raise ValueError("in boot")
        return Command()

    def step(self, percept):
        if self.exits and self.robot == 0 and percept.tick == 3:
            lamplight.always(False, "goes on")
            os._exit(3)
        return Command()
"#;

#[test]
fn what_is_stated_just_before_the_end_of_a_life_counts() {
    if interpreter().is_none() {
        return;
    }
    let folder = folder("hang_timeout_s = 60\n[controller]\npython = \"my.py\"\n");
    fs::write(folder.path().join("my.py"), ENDING).unwrap();
    let run = |more: &[&str]| {
        summary(&in_folder(folder.path(), &[&["run", "s.toml", "--quiet", "--json"], more].concat()))
    };
    let plan = r#"fault=[{ kind = "kill", at_s = 0.5, restart_at_s = 1, robots = "1-2" }]"#;
    for policy in ["exclude", "restart"] {
        let policy = format!("processes.on_hang={policy}");
        let args = ["--set", plan, "--set", &policy];
        let (processes, in_process) = (run(&args), run(&[&args[..], &["--engine", "in-process"]].concat()));
        for (name, robot) in [("made", 1), ("booted", 2)] {
            let first = json!({ "robot": robot, "life": 2, "tick": null });
            assert_eq!(
                processes["always"][name],
                json!({ "robots": 4, "broken_by": 1, "first": first }),
                "{policy}"
            );
        }
        for key in ["digest", "always", "sometimes", "robots_alive"] {
            assert_eq!(in_process[key], processes[key], "{key} {policy}");
        }
    }
    let exited = run(&["--set", "controller.params.exits=true"]);
    assert_eq!(exited["incidents"][0]["tick"], 3);
    assert_eq!(exited["always"]["goes on"]["first"]["tick"], 3, "an exit loses nothing");
}

#[test]
fn names_that_change_end_a_robot_and_names_that_are_none_raise() {
    if interpreter().is_none() {
        return;
    }
    let folder = folder("[controller]\npython = \"my.py\"\n");
    let told = |body: &str| {
        let text = format!(
            "import lamplight\nclass It(lamplight.Controller):\n    def step(self, percept):\n        {body}\n        \
             return lamplight.Command()\n"
        );
        fs::write(folder.path().join("my.py"), text).unwrap();
        let words = [
            "run",
            "s.toml",
            "--quiet",
            "--json",
            "--engine",
            "in-process",
            "--set",
            "processes.on_hang=fail",
        ];
        let output = in_folder(folder.path(), &words);
        assert_eq!(output.status.code(), Some(1), "{body}");
        said(&output)
    };
    for (body, words) in [
        ("for i in range(65): lamplight.always(True, f\"{i}\")", "it states more than 64 properties; `64`"),
        ("lamplight.sometimes(True, \"\")", "a property's name is ``"),
        ("lamplight.always(True, \"a\\nb\")", "no control characters"),
    ] {
        assert!(told(body).contains(words), "{body}: {}", told(body));
    }
}

#[test]
fn fuzz_finds_the_planted_mistake_of_the_guide_and_shrink_the_two_faults_that_it_takes() {
    if interpreter().is_none() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let fuzz = |more: &[&str]| {
        let file = example("consensus.toml");
        let words =
            [&["fuzz", file.to_str().unwrap(), "--quiet", "--engine", "in-process", "--runs", "200"], more];
        in_folder(folder.path(), &words.concat())
    };
    let found = fuzz(&["--out", "."]);
    assert_eq!(found.status.code(), Some(1), "{}", said(&found));
    assert!(
        stdout(&found).contains("failed: always \"nobody decides otherwise\": broken by "),
        "{}",
        said(&found)
    );
    // The command that it prints.
    let shrink =
        stdout(&found).lines().find_map(|line| line.strip_prefix("  shrink: ").map(str::to_owned)).unwrap();
    let words: Vec<&str> = shrink.split('\'').flat_map(str::split_whitespace).collect();
    let file = words[2];
    let until = "always.\"nobody decides otherwise\".broken_by > 0";
    assert_eq!(shrink, format!("lamplight shrink {file} --until '{until}'"));
    let small =
        in_folder(folder.path(), &["shrink", file, "--until", until, "--quiet", "--out", "small.toml"]);
    assert!(small.status.success(), "{}", said(&small));
    let told = stdout(&small);
    let kinds: Vec<&str> = told
        .lines()
        .filter_map(|line| line.strip_prefix("  ")?.split_once(':'))
        .map(|(kind, _)| kind)
        .collect();
    assert_eq!(kinds.len(), 2, "{told}");
    assert!(kinds.contains(&"kill") && kinds.contains(&"burst"), "{told}");
    // As processes, too.
    let again = summary(&in_folder(folder.path(), &["run", "small.toml", "--quiet", "--json"]));
    assert!(again["always"]["nobody decides otherwise"]["broken_by"].as_u64().unwrap() > 0);

    let sound = fuzz(&["--set", "controller.params.hasty=false"]);
    assert!(sound.status.success(), "without the mistake: {}", said(&sound));
    assert!(!stdout(&sound).contains("never reached"), "{}", said(&sound));
}

/// Says that it is lost once it has heard nobody, and never that it has arrived.
const JSON_LINES: &str = r#"
const lines = require("readline").createInterface({ input: process.stdin });
let booted = false;
lines.on("line", (line) => {
  const percept = JSON.parse(line);
  const answer = {};
  if (booted) {
    answer.tick = percept.tick;
    answer.always = { "in touch": percept.neighbors.length > 0 };
    answer.sometimes = { "arrived": false };
  }
  booted = true;
  console.log(JSON.stringify(answer));
});
"#;

#[test]
fn programs_are_fuzzed_and_shrunk_as_processes() {
    if !Command::new("node").arg("--version").output().is_ok_and(|output| output.status.success()) {
        eprintln!("SKIPPED: there is no node");
        return;
    }
    let folder = folder(
        "hang_timeout_s = 60\n[controller]\nprogram = [\"node\", \"mind.js\"]\nspeaks = \"json-lines\"\n\
         [fuzz]\nkinds = [\"burst\", \"pause\"]\n",
    );
    fs::write(folder.path().join("mind.js"), JSON_LINES).unwrap();
    let words = ["fuzz", "s.toml", "--runs", "4", "--quiet", "--out", "failed", "--set", "robots.count=2"];
    let found = in_folder(folder.path(), &words);
    assert_eq!(found.status.code(), Some(1), "{}", said(&found));
    assert!(stdout(&found).contains("failed: always \"in touch\": broken by "), "{}", said(&found));
    assert!(stdout(&found).contains("never reached: sometimes \"arrived\"\n"), "{}", said(&found));

    let plan = r#"fault=[{ kind = "slow", delay_s = 0.1, robots = [0] }, { kind = "loss", from_s = 0.5, probability = 1.0 },
                         { kind = "pause", from_s = 1, until_s = 1.5, robots = [1] }]"#;
    let until = "always.'in touch'.broken_by == 2";
    let words = ["shrink", "s.toml", "--quiet", "--set", "robots.count=2", "--set", plan, "--until", until];
    let small = in_folder(folder.path(), &words);
    assert!(small.status.success(), "{}", said(&small));
    assert!(stdout(&small).contains("1 of 3 faults and 2 of 2 robots"), "{}", said(&small));
    let refused = in_folder(folder.path(), &["fuzz", "s.toml", "--engine", "in-process"]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(said(&refused).contains("need processes"), "{}", said(&refused));
}

//! Controllers in any language, which speak lines of JSON.

#![allow(clippy::unwrap_used, reason = "these are tests, helpers included")]

use std::{
    fs,
    os::unix::fs::PermissionsExt,
    path::{Path, PathBuf},
    process::{Command, Output, Stdio},
    thread,
    time::Duration,
};

use rustix::process::{Pid, Signal, kill_process};
use serde_json::{Value, json};
use tempfile::TempDir;
use tests::{
    live::{agents_of, descendants, wait_until},
    programs::{lamplight, said},
};

fn example() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/json-lines")
}

fn has(program: &str) -> bool {
    let is_there = Command::new(program).arg("--version").output().is_ok();
    if !is_there {
        eprintln!("SKIPPED: there is no {program}");
    }
    is_there
}

fn summary(output: &Output) -> Value {
    assert!(output.status.success(), "{}", said(output));
    serde_json::from_slice(&output.stdout).unwrap()
}

/// Compiles the example in C into a folder that also has the other one, and the scenario.
fn built() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for file in ["scenario.toml", "to-the-light.js"] {
        fs::copy(example().join(file), folder.path().join(file)).unwrap();
    }
    let compiled = Command::new("cc")
        .args(["-O2", "-Wall", "-Wextra", "-Werror", "-o"])
        .arg(folder.path().join("to-the-light"))
        .arg(example().join("to_the_light.c"))
        .arg("-lm")
        .output()
        .unwrap();
    assert!(compiled.status.success(), "{}", said(&compiled));
    folder
}

#[test]
fn the_examples_play_beside_the_papers_robots_and_repeat_themselves() {
    if !(has("node") && has("cc")) {
        return;
    }
    let folder = built();
    let plan = r#"fault=[{ kind = "kill", at_s = 1, restart_at_s = 2, robots = "5-14" },
                         { kind = "pause", from_s = 3, until_s = 4, robots = "0-20" }]"#;
    let run = |args: &[&str]| {
        let mut command = lamplight(["run", "--quiet", "--json", "--duration", "6"]);
        // From elsewhere: the scenario's files are beside it.
        summary(&command.arg(folder.path().join("scenario.toml")).args(args).output().unwrap())
    };
    let once = run(&["--set", plan]);
    assert_eq!((&once["incidents"], &once["robots_alive"]), (&json!([]), &json!(50)));
    assert_eq!(run(&["--set", plan])["digest"], once["digest"]);
    let crossed = [
        "--set",
        plan,
        "--set",
        r#"controller.0.program=["./to-the-light"]"#,
        "--set",
        r#"controller.1.program=["node", "to-the-light.js"]"#,
    ];
    // The one in C says nothing, which its neighbors hear.
    assert_eq!(run(&crossed)["packets"]["sent"], once["packets"]["sent"]);
}

/// Three robots with a script in sh beside the file, which ends with what it does at its third question.
fn of_shell(third: &str) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let text = "duration_s = 1\nstep_s = 0.1\narena.size_m = [2, 2]\nrobots.count = 3\nchannel.range_m = 1\n\
                [processes]\nhang_timeout_s = 1\n\
                [controller]\nprogram = [\"./mind\"]\nspeaks = \"json-lines\"\n";
    fs::write(folder.path().join("s.toml"), text).unwrap();
    let script = format!(
        "#!/bin/sh\nread line; echo '{{}}'\nread line; echo '{{\"tick\":0}}'\nread line\n{third}\n\
         tick=2; while read line; do echo '{{\"tick\":'$tick'}}'; tick=$((tick+1)); done\n"
    );
    let mind = folder.path().join("mind");
    fs::write(&mind, script).unwrap();
    fs::set_permissions(&mind, fs::Permissions::from_mode(0o755)).unwrap();
    folder
}

#[test]
fn what_is_no_answer_ends_its_robot_and_is_named() {
    let cases = [
        ("echo hello", "has answered `hello`: it is no command: expected value"),
        ("echo '{\"tick\":0}'", "it answers tick 0, and tick 1 was asked"),
        ("echo '{\"tick\":1,\"velocity\":[1e400,0]}'", "it is no command: number out of range"),
        ("echo '{\"tick\":1,\"payload\":\"%\"}'", "its payload is no base64"),
        ("head -c 100000 /dev/zero | tr '\\0' x", "has answered a line of more than 65536 bytes"),
        ("exit 4", "has ended without an answer (exit status: 4)"),
        ("sleep 1000", "has not answered tick 1 for 1s"),
    ];
    for (third, expected) in cases {
        let folder = of_shell(third);
        let name = format!("test-json-lines-{}", std::process::id());
        // Under load those who do not hang may take their time.
        let patience = if third.starts_with("sleep") { "1" } else { "60" };
        let output = lamplight(["run", "s.toml", "--quiet", "--name", &name])
            .args(["--set", &format!("processes.hang_timeout_s={patience}")])
            .current_dir(folder.path())
            .output()
            .unwrap();
        let told = said(&output);
        assert!(told.contains(expected), "{third}: {told}");
        assert!(
            told.contains("it is left out from tick 2 on") && told.contains("no robot is left"),
            "{told}"
        );
        assert!(agents_of(&name).is_empty(), "{third}");
    }
    let flood = "i=0; while [ $i -lt 5000 ]; do echo much $i >&2; i=$((i+1)); done; echo '{\"tick\":1}'";
    let folder = of_shell(flood);
    let output = lamplight(["run", "s.toml", "--quiet", "--json", "--set", "processes.hang_timeout_s=60"])
        .current_dir(folder.path())
        .output()
        .unwrap();
    assert_eq!(summary(&output)["robots_alive"], 3);
    assert_eq!(String::from_utf8_lossy(&output.stderr).matches("much ").count(), 15_000);
}

#[test]
fn no_process_is_left_whichever_of_the_three_is_killed() {
    for victim in ["supervisor", "agent", "program"] {
        let folder = of_shell("while :; do :; done");
        let name = format!("test-json-lines-{victim}-{}", std::process::id());
        let mut supervisor = lamplight(["run", "s.toml", "--quiet", "--name", &name])
            .args(["--set", "processes.hang_timeout_s=1000"])
            .current_dir(folder.path())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        wait_until("all agents are there", || agents_of(&name).len() == 3);
        thread::sleep(Duration::from_millis(500));
        let all = descendants(Pid::from_child(&supervisor));
        for agent in agents_of(&name).into_values() {
            let theirs = descendants(agent);
            match victim {
                "agent" => kill_process(agent, Signal::KILL).unwrap(),
                // The shell, and what it waits for.
                "program" => {
                    for pid in theirs {
                        // One may have ended with another.
                        let _ = kill_process(pid, Signal::KILL);
                    }
                }
                _ => {}
            }
        }
        if victim == "supervisor" {
            kill_process(Pid::from_child(&supervisor), Signal::KILL).unwrap();
        }
        assert!(!supervisor.wait().unwrap().success());
        wait_until("all have ended", || {
            all.iter().all(|pid| !Path::new(&format!("/proc/{}", pid.as_raw_pid())).exists())
        });
        assert!(lamplight(["clean"]).stdout(Stdio::null()).status().unwrap().success());
    }
}

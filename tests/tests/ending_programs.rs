//! Programs that end by themselves: when the news of it comes is chance, what comes of it is not.

#![allow(clippy::unwrap_used, reason = "these are tests, helpers included")]

use std::{
    fs,
    os::unix::fs::PermissionsExt,
    path::{Path, PathBuf},
};

use tempfile::TempDir;
use tests::programs::{Run, lamplight, program, said};

/// Robots and params of each program's entry.
type Entries = [(&'static str, &'static str)];

/// Twelve robots of a few entries, all of which name the same program.
fn scenario(folder: &Path, on_hang: &str, entries: &Entries) -> PathBuf {
    // A test may have it removed.
    fs::copy(program("scripted-agent"), folder.join("mind")).unwrap();
    let entry = |(robots, params): &(&str, &str)| {
        format!("[[controller]]\nrobots = {robots:?}\nprogram = [\"./mind\"]\nparams = {{ {params} }}\n")
    };
    let entries: String = entries.iter().map(entry).collect();
    let file = folder.join("twelve.toml");
    let text = format!(
        "duration_s = 2\nstep_s = 0.1\narena.size_m = [2, 2]\nrobots.count = 12\nchannel.range_m = 1\n\
         processes.on_hang = {on_hang:?}\n{entries}"
    );
    fs::write(&file, text).unwrap();
    file
}

fn run(on_hang: &str, entries: &Entries, options: &[&str]) -> Run {
    let folder = tempfile::tempdir().unwrap();
    let file = scenario(folder.path(), on_hang, entries);
    run_of(&file, folder, options)
}

fn run_of(file: &Path, folder: TempDir, options: &[&str]) -> Run {
    let out = folder.path().join("out");
    let output = lamplight(["run", "--quiet", "--out"]).arg(out).arg(file).args(options).output().unwrap();
    assert!(output.status.success(), "{}", said(&output));
    Run::in_folder(folder)
}

/// The parts that are the same in equal runs: the digest, and who has lost what when, without the numbers of processes.
fn course(run: &Run) -> (String, Vec<String>) {
    let out = run.file("");
    let folder = out.ancestors().nth(1).unwrap().display().to_string();
    let incidents = run.summary["incidents"].as_array().unwrap().iter().map(|incident| {
        let what = incident["what"].as_str().unwrap().replace(&folder, "");
        let what = match what.split_once(" (pid ") {
            Some((robot, rest)) => format!("{robot}{}", rest.split_once(')').unwrap().1),
            None => what,
        };
        format!("tick {}: {what}", incident["tick"])
    });
    (run.digest().to_owned(), incidents.collect())
}

/// Half of the robots end, in two ways.
const ENDING: &Entries = &[
    ("0-2", "ends_in_step = 3, ends_by = \"exit\", begins_after_ms = 30"),
    ("3-5", "ends_in_step = 8, ends_by = \"panic\", begins_after_ms = 5"),
    ("6-11", ""),
];

#[test]
fn lives_that_end_by_themselves_and_begin_anew_give_one_digest() {
    let first = run("restart", ENDING, &[]);
    let expected = course(&first);
    // Ticks 0 to 20 have a step each: every third, or eighth, ends a life, and the next one has the step after it.
    assert_eq!(expected.1.len(), 3 * 7 + 3 * 2, "{:#?}", expected.1);
    for robot in first.robots() {
        let lives = [7, 2, 0, 0][robot.robot as usize / 3];
        assert_eq!((robot.incarnation, robot.alive), (lives, true), "{robot:?}");
    }
    for plane in ["blackboard", "blackboard", "publish-subscribe", "publish-subscribe"] {
        let again = run("restart", ENDING, &["--set", &format!("processes.plane={plane}")]);
        assert_eq!(course(&again), expected, "{plane}");
    }
}

#[test]
fn lives_that_end_by_themselves_and_are_left_out_give_one_course() {
    let expected = course(&run("exclude", ENDING, &[]));
    assert_eq!(expected.1.len(), 6, "{:#?}", expected.1);
    assert_eq!(
        expected.1[0],
        "tick 2: robot 0 died before it answered tick 2 (exit status 3; its program is /mind); \
         it is left out from tick 3 on"
    );
    for _ in 0..3 {
        assert_eq!(course(&run("exclude", ENDING, &[])), expected);
    }
}

#[test]
fn a_script_around_a_program_may_stay_or_become_it() {
    let expected = course(&run("restart", ENDING, &[]));
    for (script, status) in [("\"$0.real\" \"$@\"\nexit 4\n", "4"), ("exec \"$0.real\" \"$@\"\n", "3")] {
        let folder = tempfile::tempdir().unwrap();
        let file = scenario(folder.path(), "restart", ENDING);
        let mind = folder.path().join("mind");
        fs::rename(&mind, folder.path().join("mind.real")).unwrap();
        fs::write(&mind, format!("#!/bin/sh\n{script}")).unwrap();
        fs::set_permissions(&mind, fs::Permissions::from_mode(0o755)).unwrap();
        let run = run_of(&file, folder, &[]);
        let (digest, incidents) = course(&run);
        assert_eq!((digest, incidents.len()), (expected.0.clone(), expected.1.len()), "{script}");
        assert!(incidents[0].contains(&format!("(exit status {status}; ")), "{incidents:#?}");
    }
}

#[test]
fn a_run_that_must_not_lose_anyone_names_the_first_robot_of_the_tick() {
    for _ in 0..3 {
        let folder = tempfile::tempdir().unwrap();
        let file = scenario(folder.path(), "fail", ENDING);
        let out = folder.path().join("out");
        let output = lamplight(["run", "--quiet", "--out"]).arg(&out).arg(file).output().unwrap();
        assert_eq!(output.status.code(), Some(1), "{}", said(&output));
        let error = String::from_utf8(output.stderr).unwrap();
        assert!(error.starts_with("error: robot 0 (pid ") && error.lines().count() == 1, "{error}");
        let left = Run::in_folder(folder);
        let (_, incidents) = course(&left);
        assert!(incidents.len() == 1 && incidents[0].ends_with("; the run fails"), "{incidents:#?}");
        assert_eq!(left.number("robots_alive"), 11.0);
    }
}

#[test]
fn a_plan_for_robots_that_also_end_by_themselves_gives_one_course() {
    let fault = "fault=[{ kind = \"kill\", at_s = 0.3, restart_at_s = 0.5, robots = \"0-4\" }, \
                 { kind = \"pause\", from_s = 0.8, until_s = 1.2, robots = \"1-5\" }]";
    let expected = course(&run("restart", ENDING, &["--set", fault]));
    assert!(!expected.1.is_empty());
    for _ in 0..3 {
        assert_eq!(course(&run("restart", ENDING, &["--set", fault])), expected);
    }
}

#[test]
fn a_program_that_is_gone_when_a_life_begins_anew_costs_its_robot_and_nothing_else() {
    let gone = &[("3", "ends_in_step = 3, removes_program = true"), ("0-2,4-11", "")];
    let run = run("restart", gone, &[]);
    let (_, incidents) = course(&run);
    assert_eq!(run.summary["ended"], "finished");
    assert_eq!((run.number("robots_alive"), incidents.len()), (11.0, 6), "{incidents:#?}");
    assert!(incidents[0].starts_with("tick 2: robot 3 died before it answered tick 2 (exit status 3; "));
    let starts = "tick 2: the agent of robot 3 (life 2), /mind, cannot be started: ";
    assert!(incidents[1].starts_with(starts), "{incidents:#?}");
    let ends = "; it is left out from here on: none of 5 lives in a row has joined";
    assert!(incidents[5].ends_with(ends), "{incidents:#?}");
}

#[test]
fn a_program_that_is_gone_when_the_plan_restarts_its_robot_is_left_out() {
    let gone = &[("3", "ends_in_step = 3, removes_program = true"), ("0-2,4-11", "")];
    // Robot 6 ends the run in its pause, robot 5 left out.
    let fault = "fault=[{ kind = \"kill\", at_s = 0.2, restart_at_s = 0.5, robots = \"5\" }, \
                 { kind = \"pause\", from_s = 0.5, until_s = 1, robots = \"5-6\" }]";
    let run = run("exclude", gone, &["--set", fault, "--duration", "0.5"]);
    let left_out: Vec<u32> =
        run.robots().iter().filter(|robot| !robot.alive).map(|robot| robot.robot).collect();
    let counts = ["robots_alive", "robots_paused", "robots_silent"].map(|count| run.number(count));
    assert_eq!((left_out, counts), (vec![3, 5], [10.0, 1.0, 0.0]));
}

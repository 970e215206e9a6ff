//! `lamplight shrink` and `lamplight fuzz`, as a user would use them.

#![allow(clippy::unwrap_used, reason = "these are tests, helpers included")]

use std::{
    collections::BTreeMap,
    ffi::OsStr,
    fs,
    path::{Path, PathBuf},
    process::{Child, Command, Output, Stdio},
};

use rustix::process::{Pid, Signal, kill_process};
use tempfile::TempDir;
use tests::{
    live::{agents_of, arena_under, signal, wait_until},
    programs::{lamplight, said, scenario},
};

fn in_folder(folder: &TempDir, command: &str, file: &Path, args: &[&str]) -> Command {
    let mut lamplight = lamplight([OsStr::new(command), file.as_os_str()]);
    lamplight.args(args).current_dir(folder.path());
    lamplight
}

fn shrink(folder: &TempDir, file: &Path, args: &[&str]) -> Output {
    in_folder(folder, "shrink", file, args).output().unwrap()
}

fn fuzz(folder: &TempDir, args: &[&str]) -> Output {
    in_folder(folder, "fuzz", &scenario("swarmbots"), args).output().unwrap()
}

fn stdout(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

fn interrupted(child: Child) -> Output {
    kill_process(Pid::from_child(&child), Signal::INT).unwrap();
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130), "{}", said(&output));
    output
}

fn folder() -> TempDir {
    tempfile::tempdir().unwrap()
}

fn names(folder: &TempDir) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder.path())
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

/// Swarmbots with this fault plan.
fn with_faults(folder: &TempDir, faults: &str) -> PathBuf {
    let path = folder.path().join("faulty.toml");
    let swarmbots = fs::read_to_string(scenario("swarmbots")).unwrap();
    fs::write(&path, swarmbots + faults).unwrap();
    path
}

#[test]
fn no_more_robots_are_left_than_a_failure_needs() {
    let folder = folder();
    let output = shrink(
        &folder,
        &scenario("swarmbots"),
        &["--until", "robots_alive > 3", "--duration", "2", "--quiet"],
    );
    assert!(output.status.success(), "{}", said(&output));
    assert!(
        stdout(&output).starts_with("0 of 0 faults and 4 of 50 robots still show it"),
        "{}",
        said(&output)
    );
    assert_eq!(names(&folder), ["swarmbots-shrunk.toml"], "the journal is gone");
    let again = in_folder(
        &folder,
        "run",
        Path::new("swarmbots-shrunk.toml"),
        &["--engine", "in-process", "--json", "--quiet"],
    );
    let output = { again }.output().unwrap();
    let summary: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(summary["robots_alive"], 4);
}

#[test]
fn of_ten_faults_the_two_that_matter_are_found() {
    let folder = folder();
    let harmless = |robot| {
        format!("[[fault]]\nkind = \"loss\"\nprobability = 0.1\nrobots = {robot}\nfrom_s = 1\nuntil_s = 2\n")
    };
    let kill = |robot| format!("[[fault]]\nkind = \"kill\"\nat_s = 1.5\nrobots = {robot}\n");
    let plan: String =
        (0..10).map(|place| if matches!(place, 3 | 8) { kill(place) } else { harmless(place) }).collect();
    let file = with_faults(&folder, &plan);
    let until = "robots == 50 && robots_alive < 49";
    let output = shrink(&folder, &file, &["--until", until, "--duration", "3", "--quiet"]);
    assert!(output.status.success(), "{}", said(&output));
    let text = stdout(&output);
    assert!(text.starts_with("2 of 10 faults and 50 of 50 robots still show it"), "{text}");
    assert!(text.contains("kill: at_s = 1.5, robots = \"3\"\n"), "{text}");
    assert!(text.contains("kill: at_s = 1.5, robots = \"8\"\n"), "{text}");
}

#[test]
fn what_does_not_fail_is_not_shrunk() {
    let folder = folder();
    let file = scenario("swarmbots");
    let output = shrink(&folder, &file, &["--until", "robots_alive < 50", "--duration", "1"]);
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    assert_eq!(
        String::from_utf8_lossy(&output.stderr),
        "error: the failure does not show: robots_alive is 50\n"
    );
    assert!(names(&folder).is_empty());
}

#[test]
fn a_question_that_makes_no_sense_is_refused() {
    let folder = folder();
    let file = scenario("swarmbots");
    let check = |until: &str, expected: &str| {
        let output = shrink(&folder, &file, &["--until", until, "--duration", "1"]);
        assert_eq!(output.status.code(), Some(2), "{}", said(&output));
        assert!(String::from_utf8_lossy(&output.stderr).contains(expected), "{}", said(&output));
    };
    check("robots_alive = 3", "error: --until 'robots_alive = 3': column 14: expected `==`, found `=`");
    check("robots_alve > 3", "the summary has no `robots_alve`; did you mean `robots_alive`?");
    assert!(names(&folder).is_empty());
}

#[test]
fn a_file_that_is_there_is_not_overwritten() {
    let folder = folder();
    fs::write(folder.path().join("swarmbots-shrunk.toml"), "precious").unwrap();
    let output = shrink(&folder, &scenario("swarmbots"), &["--until", "robots_alive > 3"]);
    assert_eq!(output.status.code(), Some(2), "{}", said(&output));
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(
        message.contains("swarmbots-shrunk.toml is there already; give --out the name of a new file"),
        "{message}"
    );
    assert_eq!(fs::read_to_string(folder.path().join("swarmbots-shrunk.toml")).unwrap(), "precious");
}

#[test]
fn an_interrupted_shrink_goes_on_where_it_was() {
    let folder = folder();
    let file = scenario("swarmbots");
    let args = ["--until", "robots_alive > 20", "--duration", "400", "--out", "small.toml"];
    let child = in_folder(&folder, "shrink", &file, &args)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let journal = folder.path().join("small.toml.journal");
    wait_until("a verdict is written", || fs::metadata(&journal).is_ok_and(|journal| journal.len() > 0));
    let output = interrupted(child);
    assert!(String::from_utf8_lossy(&output.stderr).contains("the same command goes on from there"));
    assert_eq!(names(&folder), ["small.toml.journal"]);
    let known = fs::read_to_string(&journal).unwrap().lines().count();
    // As if it had been killed while it wrote.
    fs::write(&journal, fs::read_to_string(&journal).unwrap() + "{\"candi").unwrap();

    let tries = |output: &Output| -> usize {
        assert!(output.status.success(), "{}", said(output));
        assert!(stdout(output).starts_with("0 of 0 faults and 21 of 50 robots"), "{}", said(output));
        let text = stdout(output);
        text.split("found in ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap()
    };
    let resumed = shrink(&folder, &file, &args);
    let message = String::from_utf8_lossy(&resumed.stderr).into_owned();
    assert!(message.contains(&format!("going on from {known} verdicts")), "{message}");
    let small = fs::read(folder.path().join("small.toml")).unwrap();
    let afresh = shrink(&folder, &file, &[&args[..4], &["--out", "other.toml", "--quiet"]].concat());
    assert_eq!(tries(&resumed) + known, tries(&afresh));
    assert_eq!(small, fs::read(folder.path().join("other.toml")).unwrap());
    assert_eq!(names(&folder), ["other.toml", "small.toml"]);
}

#[test]
fn random_plans_break_nothing_in_process() {
    let folder = folder();
    let output = fuzz(
        &folder,
        &["--runs", "30", "--seed", "1", "--engine", "in-process", "--duration", "5", "--quiet"],
    );
    assert!(output.status.success(), "{}", said(&output));
    assert_eq!(stdout(&output), "30 runs, 0 failed\n");
}

#[test]
fn random_plans_do_the_same_to_processes() {
    let folder = folder();
    let output = fuzz(&folder, &["--runs", "4", "--robots", "12", "--duration", "4", "--quiet"]);
    assert!(output.status.success(), "{}", said(&output));
    assert_eq!(stdout(&output), "4 runs, 0 failed\n");
}

#[test]
fn random_changes_of_the_field_do_the_same_to_processes() {
    let folder = folder();
    let kinds = "fuzz.kinds=[\"field\", \"kill\", \"sensor\"]";
    let args = ["--runs", "4", "--robots", "12", "--duration", "4", "--quiet", "--set", kinds];
    let output = fuzz(&folder, &args);
    assert!(output.status.success(), "{}", said(&output));
    assert_eq!(stdout(&output), "4 runs, 0 failed\n");
}

#[test]
fn a_failed_run_says_how_to_repeat_it() {
    let folder = folder();
    let args = ["--robots", "250", "--engine", "in-process", "--set", "fuzz.kinds=[\"loss\"]", "--quiet"];
    let output = fuzz(&folder, &[&["--runs", "2", "--seed", "7", "--out", "failed"], &args[..]].concat());
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    let text = stdout(&output);
    assert!(text.starts_with("seed 7 failed: cannot place robot "), "{text}");
    assert!(text.ends_with("2 runs, 2 failed\n"), "{text}");
    assert!(text.contains("  saved as failed/swarmbots-seed-8.toml\n"), "{text}");
    let saved = folder.path().join("failed/swarmbots-seed-8.toml");
    assert!(fs::read_to_string(saved).unwrap().contains("\nseed = 8\n"));
    let repeat = text.lines().filter_map(|line| line.strip_prefix("  repeat: lamplight ")).nth(1).unwrap();
    let expected = format!(
        "fuzz {} --runs 1 --seed 8 --engine in-process --set 'fuzz.kinds=[\"loss\"]' --robots 250",
        scenario("swarmbots").display()
    );
    assert_eq!(repeat, expected);
}

#[test]
fn fuzzing_ends_with_its_processes_when_it_is_interrupted() {
    let folder = folder();
    let args = ["--runs", "1000", "--seed", "4242000", "--robots", "6", "--duration", "600"];
    let args = [&args[..], &["--set", "fuzz.kinds=[\"sensor\"]"]].concat();
    let child = in_folder(&folder, "fuzz", &scenario("swarmbots"), &args)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // Runs are named after their seeds, which no other test uses.
    let traces = || {
        let entries = fs::read_dir("/dev/shm").unwrap().map(|entry| entry.unwrap().file_name());
        entries.filter(|name| name.to_str().unwrap().starts_with("lamplight-fuzz-4242")).count()
    };
    wait_until("a run of processes is on", || traces() > 0);
    let output = interrupted(child);
    assert!(stdout(&output).contains(" of 1000 runs, 0 failed; interrupted\n"), "{}", said(&output));
    assert_eq!(traces(), 0);
}

#[test]
fn seeds_end_where_a_summary_can_hold_them() {
    let folder = folder();
    let output = fuzz(&folder, &["--runs", "2", "--seed", "9007199254740991"]);
    assert_eq!(output.status.code(), Some(2), "{}", said(&output));
    assert!(
        String::from_utf8_lossy(&output.stderr).contains("use fewer runs or a lower --seed"),
        "{}",
        said(&output)
    );
}

#[test]
fn a_fuzz_run_that_lost_an_agent_from_outside_is_repeated() {
    let folder = folder();
    let args = [
        "--runs",
        "1",
        "--robots",
        "4",
        "--duration",
        "300",
        "--set",
        "fuzz.kinds=[\"loss\"]",
        "--seed",
        "7",
    ];
    let fuzz = in_folder(&folder, "fuzz", &scenario("swarmbots"), &args)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let agents = || arena_under(&fuzz).map_or_else(BTreeMap::new, |(name, _)| agents_of(&name));
    wait_until("the swarm is there", || agents().len() == 4);
    agents().values().take(1).for_each(|&pid| signal(pid, Signal::KILL));
    let output = fuzz.wait_with_output().unwrap();
    assert!(output.status.success(), "{}", said(&output));
    assert_eq!(stdout(&output), "1 runs, 0 failed, 1 repeated because they lost processes\n");
    assert!(said(&output).contains("seed 7 is repeated: "), "{}", said(&output));
}

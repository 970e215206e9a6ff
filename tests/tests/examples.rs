//! Controllers and observers of users' own, as `examples/` have them: crates outside the workspace.

#![allow(clippy::unwrap_used, reason = "these are tests, helpers included")]

use std::{
    ffi::OsStr,
    fs,
    os::unix::fs::symlink,
    path::{Path, PathBuf},
    process::{Command, Output},
};

use serde_json::{Value, json};
use tests::programs::{lamplight, program, said, scenario};

/// Folder of the programs of an example, built as its README says, but beside the other programs.
fn built(example: &str) -> PathBuf {
    let release = program("lamplight");
    let target = release.ancestors().nth(2).unwrap().join("examples");
    let output = Command::new(env!("CARGO"))
        .args(["build", "--release", "--locked", "--manifest-path"])
        .arg(example_folder(example).join("Cargo.toml"))
        .env("CARGO_TARGET_DIR", &target)
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", said(&output));
    target.join("release")
}

fn example_folder(example: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples").join(example)
}

fn rust_controller() -> PathBuf {
    built("rust-controller").join("rust-controller")
}

fn summary_of(output: &Output) -> Value {
    assert!(output.status.success(), "{}", said(output));
    serde_json::from_slice(&output.stdout).unwrap()
}

/// Writes a scenario of fifty robots, of which this program thinks for the last twenty, into a folder.
fn mixed(folder: &Path, program: &Path, params: &str) -> PathBuf {
    let swarmbots = fs::read_to_string(scenario("swarmbots")).unwrap();
    let (before, rest) = swarmbots.split_once("[controller]").unwrap();
    let (law, after) = rest.split_once("\n[").unwrap();
    let path = folder.join("mixed.toml");
    let name = program.file_name().unwrap().to_str().unwrap();
    symlink(program, folder.join(name)).unwrap();
    fs::write(
        &path,
        format!(
            "{before}[[controller]]\nrobots = \"0-29\"{law}\n[[controller]]\nrobots = \"30-49\"\n\
             program = [\"./{name}\"]\nparams = {params}\n\n[{after}"
        ),
    )
    .unwrap();
    path
}

fn run(file: &Path, args: &[&str]) -> Output {
    lamplight([OsStr::new("run"), file.as_os_str()]).args(args).output().unwrap()
}

#[test]
fn robots_of_the_paper_and_robots_with_a_controller_of_their_own_make_one_swarm_in_either_engine() {
    let file = example_folder("rust-controller").join("mixed.toml");
    let program = format!("controller.1.program=[\"{}\"]", rust_controller().display());
    let run = || summary_of(&run(&file, &["--quiet", "--json", "--set", &program]));
    let processes = run();
    let alive_and_without_error = (&processes["robots_alive"], &processes["robots_without_error"]);
    assert_eq!(alive_and_without_error, (&json!(50), &json!(30)), "the example estimates no error");
    assert_eq!(processes["faults"][0]["fired_tick"], 100);
    assert_eq!(run()["digest"], processes["digest"], "and is as deterministic as the paper's");
    let in_process = Command::new(built("rust-controller").join("in-process")).arg(&file).output().unwrap();
    let in_process = summary_of(&in_process);
    for key in ["digest", "always", "sometimes"] {
        assert_eq!(in_process[key], processes[key], "{key}");
    }
    let allowed = json!({ "robots": 30, "broken_by": 0, "first": null });
    assert_eq!(processes["always"]["no faster than allowed"], allowed, "what the example states");
    assert_eq!(processes["sometimes"]["a crowd"]["robots"], 30);
}

#[test]
fn an_observer_of_ones_own_changes_nothing() {
    let file = scenario("swarmbots");
    let output = Command::new(built("custom-observer").join("custom-observer")).arg(&file).output().unwrap();
    let whole = summary_of(&run(&file, &["--engine", "in-process", "--quiet", "--json"]));
    assert!(said(&output).contains(whole["digest"].as_str().unwrap()), "{}", said(&output));
    let mut rows = csv::Reader::from_reader(&*output.stdout);
    let driven: Vec<(u32, f64)> = rows.deserialize().map(Result::unwrap).collect();
    assert!(
        driven.len() == 50 && driven.iter().all(|(_, driven_m)| (0.01..36.0).contains(driven_m)),
        "{driven:?}"
    );
}

#[test]
fn a_controller_that_refuses_its_params_says_so_in_its_own_words() {
    let folder = tempfile::tempdir().unwrap();
    let file = mixed(folder.path(), &rust_controller(), "{ speed = 0.1 }");
    let output = run(&file, &["--duration", "1", "--quiet", "--set", "processes.on_hang=fail"]);
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    let said = said(&output);
    let line =
        said.lines().find(|line| line.contains("refuses its params")).unwrap_or_else(|| panic!("{said}"));
    assert!(line.contains("rust-controller") && line.contains("unknown field `speed`"), "{line}");
    assert!((30..50).any(|robot| line.contains(&format!("robot {robot}"))), "{line}");
}

#[test]
fn what_needs_processes_says_so_where_there_are_none() {
    let folder = tempfile::tempdir().unwrap();
    let program = program("robot-agent");
    let file = mixed(folder.path(), &program, "{}");
    let commands: [(&[&str], &str); 3] = [
        (&["run", "--engine", "in-process"], "the crate `engine`"),
        (&["batch", "--trials", "2", "--out", "batch"], "the crate `engine`"),
        (&["fuzz", "--engine", "in-process"], "`lamplight fuzz`"),
    ];
    for (words, instead) in commands {
        let output = lamplight(words).arg(&file).current_dir(folder.path()).output().unwrap();
        assert_eq!(output.status.code(), Some(2), "{words:?}: {}", said(&output));
        let said = said(&output);
        assert!(said.contains("mixed.toml:") && said.contains("robots 30-49 need processes"), "{said}");
        assert!(said.contains("--engine both") || said.contains("--engine processes"), "{said}");
        assert!(said.contains(instead), "{said}");
    }
    fs::remove_file(folder.path().join("robot-agent")).unwrap();
    let output = run(&file, &["--duration", "1"]);
    assert_eq!(output.status.code(), Some(2), "{}", said(&output));
    assert!(said(&output).contains("hint: build it, or correct its path"), "{}", said(&output));
}

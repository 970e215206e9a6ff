//! `lamplight new controller`: what it makes runs as it is.

#![allow(clippy::unwrap_used, reason = "these are tests, helpers included")]

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Output},
};

use serde_json::Value;
use tempfile::TempDir;
use tests::programs::{interpreter, lamplight, program, said};

/// Makes a controller and returns its folder.
fn made(lang: &str) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let checkout = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let mut command = lamplight(["new", "controller", "to-the-light", "--lang", lang]);
    let output = command.arg("--checkout").arg(checkout).current_dir(folder.path()).output().unwrap();
    assert!(output.status.success(), "{}", said(&output));
    let made = folder.path().join("to-the-light");
    for file in ["README.md", "scenario.toml"] {
        let text = fs::read_to_string(made.join(file)).unwrap();
        assert!(!text.contains("{{"), "{file} of {lang}: {text}");
    }
    (folder, made)
}

fn run(folder: &Path, args: &[&str]) -> Value {
    let mut command = lamplight(["run", "scenario.toml", "--quiet", "--json"]);
    let output = command.args(args).current_dir(folder).output().unwrap();
    assert!(output.status.success(), "{}", said(&output));
    serde_json::from_slice(&output.stdout).unwrap()
}

fn succeeds(output: Output) {
    assert!(output.status.success(), "{}", said(&output));
}

#[test]
fn a_controller_in_python_runs_and_passes_its_tests() {
    let Some(python) = interpreter() else { return };
    let (_folder, made) = made("python");
    let summary = run(&made, &[]);
    assert_eq!(summary["robots_alive"], 20);
    assert_eq!(run(&made, &["--engine", "in-process"])["digest"], summary["digest"]);
    succeeds(Command::new(python).args(["-m", "unittest"]).current_dir(&made).output().unwrap());
}

#[test]
fn a_controller_in_lines_of_json_runs_and_passes_its_test() {
    if Command::new("node").arg("--version").output().is_err() {
        eprintln!("SKIPPED: there is no node");
        return;
    }
    let (_folder, made) = made("json-lines");
    assert_eq!(run(&made, &["--set", "controller.params.speed=0.2"])["robots_alive"], 20);
    succeeds(Command::new("node").arg("test.js").current_dir(&made).output().unwrap());
}

#[test]
fn a_controller_in_rust_runs_and_passes_its_tests() {
    let (_folder, made) = made("rust");
    let target = program("lamplight").ancestors().nth(2).unwrap().join("examples");
    // What it depends on is in the examples' lock file: no registry is asked.
    let lock = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/rust-controller/Cargo.lock");
    fs::copy(lock, made.join("Cargo.lock")).unwrap();
    for what in ["build", "test"] {
        let mut command = Command::new(env!("CARGO"));
        command.args([what, "--release", "--offline"]).env("CARGO_TARGET_DIR", &target);
        succeeds(command.current_dir(&made).output().unwrap());
    }
    let built = target.join("release/to-the-light");
    let summary = run(&made, &["--set", &format!("controller.program=[\"{}\"]", built.display())]);
    assert_eq!(summary["robots_alive"], 20);
}

#[test]
fn a_name_that_is_none_or_taken_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let refusal = |name: &str| {
        let output = lamplight(["new", "controller", name]).current_dir(folder.path()).output().unwrap();
        assert_eq!(output.status.code(), Some(2));
        String::from_utf8(output.stderr).unwrap()
    };
    for name in ["", "7up", "a/b", "..", "a b"] {
        assert!(refusal(name).contains("a name begins with a letter"), "{name}");
    }
    fs::create_dir(folder.path().join("taken")).unwrap();
    assert!(refusal("taken").contains("taken is there already"));
}

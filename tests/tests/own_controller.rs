//! Controllers of one's own: `examples/rust-controller`, a crate outside the workspace, as robots of a run.

#![allow(clippy::unwrap_used, reason = "these are tests, helpers included")]

use std::{
    path::{Path, PathBuf},
    process::Command,
};

use tests::{live::LiveRun, programs::program, programs::said};

/// The program of the example, built as its README says, but beside the other programs.
fn rust_controller() -> PathBuf {
    let release = program("lamplight");
    let target = release.ancestors().nth(2).unwrap().join("examples");
    let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/rust-controller");
    let output = Command::new(env!("CARGO"))
        .args(["build", "--release", "--locked", "--manifest-path"])
        .arg(example.join("Cargo.toml"))
        .env("CARGO_TARGET_DIR", &target)
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", said(&output));
    target.join("release/rust-controller")
}

/// Digest, robots alive and robots without an estimated error of a run in which the example drives robots 30 to 49.
fn mixed_run(agent: &Path) -> (String, u64, u64) {
    let run = LiveRun::start("swarmbots", &["--duration", "20", "--by-hand", "30-49"]);
    run.wait_until_open();
    let agents: Vec<_> = (30..50).map(|robot| run.agent_under(&mut Command::new(agent), robot)).collect();
    let (output, left) = run.finish();
    for mut agent in agents {
        assert!(agent.wait().unwrap().success());
    }
    let run = left.unwrap_or_else(|| panic!("{}", said(&output)));
    let count = |key: &str| run.number(key) as u64;
    (run.digest().to_owned(), count("robots_alive"), count("robots_without_error"))
}

#[test]
fn robots_of_the_paper_and_robots_with_a_controller_of_their_own_make_one_swarm() {
    let agent = rust_controller();
    let first = mixed_run(&agent);
    assert_eq!((first.1, first.2), (50, 20), "the example estimates no error");
    assert_eq!(mixed_run(&agent), first, "and is as deterministic as the paper's");
}

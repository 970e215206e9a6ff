//! The dependency graph is the proof of decentralization: what a robot cannot link, it cannot know.

#![allow(clippy::unwrap_used, reason = "these are tests, helpers included")]

use std::{collections::BTreeSet, process::Command};

/// Names of everything `package` links, itself included, as built on its own.
fn linked_by(package: &str) -> BTreeSet<String> {
    linked(package, &[])
}

fn linked(package: &str, features: &[&str]) -> BTreeSet<String> {
    let output = Command::new(env!("CARGO"))
        .args([
            "tree",
            "--locked",
            "--offline",
            "--edges",
            "normal",
            "--prefix",
            "none",
            "--package",
            package,
        ])
        .args(features)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let tree = String::from_utf8(output.stdout).unwrap();
    let linked: BTreeSet<String> =
        tree.lines().filter_map(|line| line.split(' ').next()).map(str::to_owned).collect();
    assert!(linked.contains(package), "{tree}");
    linked
}

/// `package` links none of `foreign`.
fn assert_knows_nothing_of(package: &str, foreign: &[&str]) {
    let linked = linked_by(package);
    for foreign in foreign {
        assert!(!linked.contains(*foreign), "{package} links {foreign}");
    }
}

#[test]
fn a_robot_links_nothing_of_the_arena() {
    let linked = linked_by("robot-agent");
    assert!(linked.contains("coverage") && linked.contains("protocol"), "{linked:?}");
    assert_knows_nothing_of("robot-agent", &["arena", "arena-daemon", "scenario", "lamplight", "spade"]);
}

#[test]
fn what_makes_a_process_of_a_controller_knows_no_controller() {
    let linked = linked("robot-agent", &["--no-default-features"]);
    assert!(!linked.contains("coverage"), "{linked:?}");
}

#[test]
fn a_robots_mind_links_no_transport_and_no_generator_of_random_numbers() {
    for mind in ["protocol", "coverage"] {
        assert_knows_nothing_of(
            mind,
            &["transport", "iceoryx2", "rustix", "rand_core", "rand_chacha", "arena", "tracing"],
        );
    }
}

#[test]
fn the_arena_links_no_transport_no_log_and_no_threads() {
    assert_knows_nothing_of("arena", &["transport", "iceoryx2", "rustix", "tokio", "tracing", "rayon"]);
}

#[test]
fn a_scenario_can_be_read_without_an_arena() {
    assert_knows_nothing_of("scenario", &["arena", "transport", "iceoryx2", "spade"]);
}

#[test]
fn what_carries_messages_knows_neither_world_nor_mind() {
    assert_knows_nothing_of("transport", &["arena", "scenario", "coverage"]);
}

/// The words by which a swarm's size or a pose in the arena would have to reach a robot.
#[test]
fn nothing_a_robot_is_told_names_its_pose_or_the_size_of_the_swarm() {
    let source =
        |file: &str| std::fs::read_to_string(format!("{}/../{file}.rs", env!("CARGO_MANIFEST_DIR"))).unwrap();
    let told = ["percept", "odometry", "controller", "setup", "frame", "packet"];
    let told = told.map(|file| format!("protocol/src/{file}")).into_iter();
    for file in told.chain(["crates/coverage/src/setup".into()]) {
        let code: String = source(&file)
            .lines()
            .filter(|line| !line.trim_start().starts_with("//"))
            .collect::<Vec<_>>()
            .join("\n")
            .to_lowercase();
        for word in ["arenapoint", "pose", "robot_count", "swarm", "size_m"] {
            assert!(!code.contains(word), "{file}.rs speaks of `{word}`");
        }
    }
}

//! The dependency graph is the proof of decentralization: what a robot cannot link, it cannot know.

#![allow(clippy::unwrap_used, reason = "these are tests, helpers included")]

use std::{collections::BTreeSet, process::Command};

/// Names of everything `package` links, itself included, as built on its own.
fn linked_by(package: &str) -> BTreeSet<String> {
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

#[test]
fn a_robot_links_nothing_of_the_arena() {
    let linked = linked_by("robot-agent");
    assert!(linked.contains("coverage") && linked.contains("protocol"), "{linked:?}");
    for foreign in ["arena", "arena-daemon", "lamplight", "spade"] {
        assert!(!linked.contains(foreign), "robot-agent links {foreign}");
    }
}

#[test]
fn a_robots_mind_links_no_transport_and_no_generator_of_random_numbers() {
    let linked = linked_by("coverage");
    for foreign in ["iceoryx2", "rustix", "rand_core", "rand_chacha", "arena", "tracing"] {
        assert!(!linked.contains(foreign), "coverage links {foreign}");
    }
}

#[test]
fn the_arena_links_no_transport_of_its_own() {
    let manifest =
        std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../crates/arena/Cargo.toml")).unwrap();
    for foreign in ["iceoryx2", "rustix", "tokio", "tracing"] {
        assert!(!manifest.contains(foreign), "arena names {foreign}");
    }
}

/// The words by which a swarm's size or a pose in the arena would have to reach a robot.
#[test]
fn nothing_a_robot_is_told_names_its_pose_or_the_size_of_the_swarm() {
    let source = |file: &str| {
        std::fs::read_to_string(format!("{}/../protocol/src/{file}.rs", env!("CARGO_MANIFEST_DIR"))).unwrap()
    };
    for file in ["percept", "odometry", "setup", "frame", "packet"] {
        let code: String = source(file)
            .lines()
            .filter(|line| !line.trim_start().starts_with("//"))
            .collect::<Vec<_>>()
            .join("\n")
            .to_lowercase();
        for word in ["arenapoint", "pose", "robot_count", "swarm", "size_m"] {
            assert!(!code.contains(word), "protocol/src/{file}.rs speaks of `{word}`");
        }
    }
}

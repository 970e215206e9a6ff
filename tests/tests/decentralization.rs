//! The dependency graph is the proof of decentralization: what a robot cannot link, it cannot know.

#![allow(clippy::unwrap_used, reason = "these are tests, helpers included")]

use std::{collections::BTreeSet, process::Command};

use arena::Arena;
use protocol::percept::Percept;
use scenario::{Override, Scenario, Sensor};
use tests::programs::scenario;

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
    assert_knows_nothing_of(
        "robot-agent",
        &["arena", "engine", "arena-daemon", "scenario", "lamplight", "spade"],
    );
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
fn the_loop_of_a_run_knows_no_process_no_file_and_no_terminal() {
    assert_knows_nothing_of(
        "engine",
        &[
            "agents",
            "transport",
            "iceoryx2",
            "processes",
            "files",
            "logging",
            "rustix",
            "nix",
            "signal-hook",
            "clap",
        ],
    );
}

#[test]
fn what_runs_processes_knows_no_arena() {
    assert_knows_nothing_of("agents", &["arena", "engine", "observe", "spade"]);
}

#[test]
fn observers_know_no_squad_of_processes() {
    assert_knows_nothing_of("observe", &["agents", "transport", "iceoryx2", "processes"]);
}

#[test]
fn a_scenario_can_be_read_without_an_arena() {
    assert_knows_nothing_of("scenario", &["arena", "transport", "iceoryx2", "spade"]);
}

#[test]
fn what_carries_messages_knows_neither_world_nor_mind() {
    assert_knows_nothing_of("transport", &["arena", "scenario", "coverage"]);
}

/// The words by which a swarm's size or a pose in the arena would have to reach a robot; what a scenario may grant has a
/// file of its own.
#[test]
fn nothing_a_robot_is_told_names_its_pose_or_the_size_of_the_swarm() {
    let source =
        |file: &str| std::fs::read_to_string(format!("{}/../{file}.rs", env!("CARGO_MANIFEST_DIR"))).unwrap();
    let told = ["percept", "odometry", "controller", "setup", "frame", "packet", "payload", "command"];
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

/// The first percept of each robot of a ready scenario.
fn percepts(name: &str, sets: &[&str]) -> (Scenario, Vec<Percept>, Arena) {
    let sets: Vec<Override> = sets.iter().map(|set| set.parse().unwrap()).collect();
    let scenario = Scenario::load(&scenario(name), &sets).unwrap();
    let mut arena = Arena::new(&scenario).unwrap();
    let percepts = arena.tick(&vec![None; scenario.robot_count() as usize]).unwrap().to_vec();
    (scenario, percepts, arena)
}

/// Returns what a percept holds beside packets, light and bump.
fn sensed(percept: &Percept) -> Vec<Sensor> {
    let sensors = [
        (Sensor::Light, true),
        (Sensor::Bump, true),
        (Sensor::Walls, !percept.walls.is_empty()),
        (Sensor::Odometry, percept.odometry.is_some()),
        (Sensor::Compass, percept.compass.is_some()),
        (Sensor::Position, percept.position.is_some()),
        (Sensor::Field, !percept.field.is_empty()),
    ];
    sensors.into_iter().filter(|(_, there)| *there).map(|(sensor, _)| sensor).collect()
}

#[test]
fn a_percept_holds_what_is_granted_and_nothing_else() {
    let walls = "arena.boundary_sensing=true";
    let (odometry, compass, position) =
        ("sensors.odometry=true", "sensors.compass=true", "sensors.position=true");
    for name in ["swarmbots", "one-gaussian"] {
        for sets in [
            &[][..],
            &[walls],
            &[odometry],
            &[compass],
            &[position],
            &["controller.law=exact", "controller.cell_cap_m=1"],
            &[walls, odometry, compass, position],
        ] {
            let (scenario, percepts, _) = percepts(name, sets);
            let granted = scenario.granted();
            assert!(
                percepts.iter().all(|percept| sensed(percept) == granted),
                "{name} {sets:?}: {granted:?}"
            );
        }
        let (scenario, ..) = percepts(name, &[]);
        let told = |sensor: &Sensor| matches!(sensor, Sensor::Compass | Sensor::Position);
        assert!(!scenario.granted().iter().any(told), "{name}: by default no robot knows where it is");
    }
}

#[test]
fn a_granted_compass_and_position_are_the_pose() {
    let (_, percepts, arena) = percepts("swarmbots", &["sensors.compass=true", "sensors.position=true"]);
    for (percept, pose) in percepts.iter().zip(arena.poses()) {
        let (compass, position) = (percept.compass.unwrap(), percept.position.unwrap());
        assert_eq!(compass.heading.get(), pose.heading);
        assert_eq!([position.x.get(), position.y.get()], [pose.position.x, pose.position.y]);
    }
}

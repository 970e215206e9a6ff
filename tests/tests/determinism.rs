//! The promise: one scenario, one seed, one digest, whatever computes it and in which order.

#![allow(clippy::unwrap_used, reason = "these are tests, helpers included")]

use std::{
    sync::atomic::{AtomicBool, Ordering},
    thread,
};

use tests::{live::LiveRun, programs::Run};

const IN_PROCESS: [&str; 2] = ["--engine", "in-process"];

/// On a machine that is busy on purpose, slow is not dead.
const PATIENT: [&str; 2] = ["--set", "processes.hang_timeout_s=60"];

/// The scenarios the promise is checked for, with the options that make them.
const SWARMS: [(&str, &[&str]); 3] = [
    ("swarmbots", &[]),
    ("two-gaussians", &["--duration", "20"]),
    ("hundred", &["--robots", "200", "--duration", "30"]),
];

#[test]
fn processes_in_lockstep_twice_and_in_process_give_one_digest() {
    for (scenario, options) in SWARMS {
        let in_process = Run::of(scenario, &[options, &IN_PROCESS].concat());
        for _ in 0..2 {
            let processes = Run::of(scenario, options);
            assert_eq!(processes.digest(), in_process.digest(), "{scenario} {options:?}");
            assert_eq!(processes.summary["packets"], in_process.summary["packets"]);
            assert_eq!(processes.number("cost_h"), in_process.number("cost_h"));
        }
    }
}

/// Every ready scenario in which something is planned to go wrong, and those with infrared of their own.
#[test]
fn what_goes_wrong_by_plan_goes_wrong_alike_in_both_engines() {
    let scenarios = [
        "lamp-side-massacre",
        "frozen-robots",
        "burst-loss",
        "partition-heals",
        "liars",
        "ten-faults",
        "r-one",
        "collisions",
    ];
    for scenario in scenarios {
        let in_process = Run::of(scenario, &IN_PROCESS);
        let processes = Run::of(scenario, &PATIENT);
        assert_eq!(processes.digest(), in_process.digest(), "{scenario}");
        for key in ["packets", "faults", "robots_alive", "delivered", "hearing_components", "staleness_s"] {
            assert_eq!(processes.summary[key], in_process.summary[key], "{scenario}: {key}");
        }
        let ledger = |run: &Run| std::fs::read_to_string(run.file("ledger.csv")).unwrap();
        assert_eq!(ledger(&processes), ledger(&in_process), "{scenario}");
    }
}

/// Clocks that drift, and robots that come back with other clocks, in every access.
#[test]
fn clocks_that_drift_send_alike_in_both_engines() {
    let faults = r#"fault=[{ kind = "kill", robots = "0-4", at_s = 2, restart_at_s = 4 },
        { kind = "kill", robots = "3-6", at_s = 5, restart_at_s = 5.1 }, { kind = "pause", robots = 8, from_s = 3, until_s = 6 }]"#;
    for access in ["random", "fixed-phase", "aligned"] {
        let (access_key, drift) = (format!("channel.access={access}"), "processes.clock_drift_ppm=20000");
        let options =
            ["--duration", "10", "--set", "channel.profile=isis", "--set", &access_key, "--set", faults];
        let drifting = [&options[..], &["--set", drift]].concat();
        let (even, in_process) = (
            Run::of("swarmbots", &[&options[..], &IN_PROCESS].concat()),
            Run::of("swarmbots", &[&drifting[..], &IN_PROCESS].concat()),
        );
        let processes = Run::of("swarmbots", &[&drifting[..], &PATIENT].concat());
        assert_eq!(processes.digest(), in_process.digest(), "{access}");
        assert_eq!(processes.summary["packets"], in_process.summary["packets"], "{access}");
        assert_eq!(even.digest() == in_process.digest(), access == "aligned", "shared cycles stay shared");
    }
}

/// Odometry with errors, stuck and drifting wheels, and robots that begin new lives.
#[test]
fn robots_turn_what_they_heard_along_alike_in_both_engines() {
    let faults = r#"fault=[{ kind = "kill", robots = "0-4", at_s = 2, restart_at_s = 4 },
        { kind = "pause", robots = 8, from_s = 3, until_s = 6 },
        { kind = "motion", robots = "10-14", from_s = 1, until_s = 5, drift_m_per_s = [0.1, 0.1] },
        { kind = "motion", robots = "20-24", from_s = 2, stuck = true }, { kind = "slow", robots = "30-34", delay_s = 0.6 }]"#;
    for profile in ["isis", "ideal"] {
        let profile = format!("channel.profile={profile}");
        let options =
            ["--duration", "10", "--set", &profile, "--set", "robots.drive=differential", "--set", faults];
        let options = [&options[..], &["--set", "controller.neighbor_timeout_cycles=4"]].concat();
        let without =
            Run::of("swarmbots", &[&options[..], &["--set", "sensors.odometry=false"], &IN_PROCESS].concat());
        let exact = Run::of("swarmbots", &[&options[..], &IN_PROCESS].concat());
        let options = [&options[..], &["--set", "sensors.odometry_error=0.2"]].concat();
        let in_process = Run::of("swarmbots", &[&options[..], &IN_PROCESS].concat());
        let processes = Run::of("swarmbots", &[&options[..], &PATIENT].concat());
        assert_eq!(processes.digest(), in_process.digest(), "{profile}");
        let digests = [without.digest(), exact.digest(), in_process.digest()];
        assert!(digests[0] != digests[1] && digests[1] != digests[2], "{profile}: {digests:?}");
    }
}

/// Lamps that are moved, dimmed and turned off, as ideal sensors, diodes and those who are shown the field see them.
#[test]
fn a_field_that_changes_is_sensed_alike_in_both_engines() {
    let faults = r#"fault=[{ kind = "field", at_s = 2, lamp = 0, position_m = [0.2, 0.3], half_distance_m = 0.4 },
        { kind = "field", at_s = 4, lamp = 1, peak = 20 }, { kind = "field", at_s = 5, offset = 3 },
        { kind = "kill", at_s = 5, share = 0.2, pick = "nearest-lamps", restart_at_s = 7 }]"#;
    let ways: [&[&str]; 3] = [
        &["--set", "channel.profile=isis"],
        &["--set", "light.sensor=ring"],
        &["--set", "controller.law=exact", "--set", "arena.boundary_sensing=true"],
    ];
    for way in ways {
        let options = [&["--duration", "10"][..], way].concat();
        let plain = Run::of("swarmbots", &[&options[..], &IN_PROCESS].concat());
        let options = [&options[..], &["--set", faults]].concat();
        let in_process = Run::of("swarmbots", &[&options[..], &IN_PROCESS].concat());
        let processes = Run::of("swarmbots", &[&options[..], &PATIENT].concat());
        assert_eq!(processes.digest(), in_process.digest(), "{way:?}");
        assert_ne!(plain.digest(), in_process.digest(), "{way:?}");
        assert_eq!(processes.summary["faults"], in_process.summary["faults"], "{way:?}");
        for key in ["cost_h", "mean_true_error_m", "mean_lamp_distance_m"] {
            assert_eq!(processes.number(key), in_process.number(key), "{way:?}: {key}");
        }
        let told = in_process.summary["faults"].as_array().unwrap();
        for change in &told[..3] {
            assert_eq!(change["effects"], serde_json::json!({ "field changes": 1 }), "{way:?}");
            assert_eq!(change["robots"], 0, "{way:?}");
        }
    }
}

#[test]
fn a_busy_machine_changes_nothing() {
    let done = AtomicBool::new(false);
    thread::scope(|scope| {
        for _ in 0..thread::available_parallelism().map_or(2, usize::from) {
            scope.spawn(|| {
                while !done.load(Ordering::Relaxed) {
                    std::hint::spin_loop()
                }
            });
        }
        for (scenario, options) in SWARMS {
            let busy = Run::of(scenario, &[options, &PATIENT].concat());
            let in_process = Run::of(scenario, &[options, &IN_PROCESS].concat());
            assert_eq!(busy.digest(), in_process.digest(), "{scenario} {options:?}");
        }
        done.store(true, Ordering::Relaxed);
    });
}

#[test]
fn the_order_in_which_agents_start_changes_nothing() {
    for (scenario, options) in SWARMS {
        let in_process = Run::of(scenario, &[options, &IN_PROCESS].concat());
        let robots = in_process.number("robots") as u32;
        let everyone: Vec<String> = (0..robots).map(|robot| robot.to_string()).collect();
        let by_hand = ["--by-hand", &everyone.join(",")];
        let run = LiveRun::start(scenario, &[options, &PATIENT, &by_hand].concat());
        run.wait_until_open();
        // 17 is coprime to every size here: a shuffle that visits every robot once.
        let agents: Vec<_> = (0..robots).map(|i| run.agent((i * 17 + 5) % robots)).collect();
        let (output, left) = run.finish();
        for mut agent in agents {
            assert!(agent.wait().unwrap().success());
        }
        let shuffled = left.unwrap_or_else(|| panic!("{}", tests::programs::said(&output)));
        assert_eq!(shuffled.digest(), in_process.digest(), "{scenario} {options:?}");
    }
}

#[test]
fn another_seed_is_another_run() {
    let digest = |seed| Run::of("swarmbots", &["--duration", "1", "--engine", "in-process", "--seed", seed]);
    assert_ne!(digest("1").digest(), digest("2").digest());
}

#[test]
fn a_resolved_scenario_gives_the_run_it_came_from() {
    for (scenario, set) in [("swarmbots", "field.offset=400"), ("liars", "seed=3"), ("r-one", "seed=4")] {
        resolved_again(scenario, set);
    }
}

fn resolved_again(scenario: &str, set: &str) {
    let first = Run::of(scenario, &["--set", set, "--engine", "in-process"]);
    let resolved = first.file("scenario.toml");
    let output = tests::programs::lamplight(["run", "--json", "--quiet", "--engine", "in-process"])
        .arg(resolved)
        .output()
        .unwrap();
    let summary: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(summary["digest"], first.digest());
}

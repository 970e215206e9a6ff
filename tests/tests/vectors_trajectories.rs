//! Reference trajectories through the whole stack: scenario file, processes, iceoryx2, lock-step,
//! random headings.

#![allow(clippy::unwrap_used, reason = "these are tests, helpers included")]

use serde::Deserialize;
use std::collections::BTreeMap;
use tests::{
    programs::Run,
    vectors::{Pair, read},
};

#[derive(Deserialize)]
struct End {
    conv_time_s: f64,
    #[serde(rename = "H0")]
    start_h: f64,
    #[serde(rename = "H_final")]
    final_h: f64,
    true_mean_error_final: f64,
    final_positions: Vec<Pair>,
}

#[derive(Deserialize)]
struct Case {
    seed: u64,
    init: Vec<Pair>,
    #[serde(rename = "euler_dt0.01")]
    euler: BTreeMap<String, Vec<Pair>>,
    #[serde(rename = "euler_dt0.01_final")]
    end: End,
}

#[derive(Deserialize)]
struct File {
    cases: Vec<Case>,
}

const TOLERANCE_M: f64 = 1e-10;

fn run(case: &Case, more: &[&str]) -> Run {
    let positions = format!("robots.positions_m={:?}", case.init);
    let count = format!("robots.count={}", case.init.len());
    let mut args = vec!["--set", &positions, "--set", &count];
    args.extend(more);
    Run::of("one-gaussian", &args)
}

fn assert_positions(what: &str, run: &Run, expected: &[Pair], tolerance_m: f64) {
    let robots = run.robots();
    assert_eq!(robots.len(), expected.len(), "{what}");
    for (robot, [x, y]) in robots.iter().zip(expected) {
        let off = (robot.x_m - x).hypot(robot.y_m - y);
        assert!(off <= tolerance_m, "{what}: robot {} is off by {off:e} m", robot.robot);
    }
}

#[test]
fn processes_follow_the_reference_trajectories() {
    let file: File = read("trajectories");
    assert!(!file.cases.is_empty());
    for case in &file.cases {
        for (time_s, expected) in case.euler.iter().filter(|(time_s, _)| *time_s != "0") {
            let run = run(case, &["--duration", time_s]);
            assert_positions(&format!("seed {} at {time_s} s", case.seed), &run, expected, TOLERANCE_M);
        }
    }
}

#[test]
fn processes_converge_when_and_where_the_reference_does() {
    #[derive(Deserialize)]
    struct Row {
        cost_h: f64,
    }
    let file: File = read("trajectories");
    for case in &file.cases {
        let what = format!("seed {}", case.seed);
        let until = |tolerance: &str| {
            let tolerance = format!("convergence.tolerance_m={tolerance}");
            run(case, &["--duration", "1000", "--set", &tolerance, "--set", "convergence.stop=true"])
        };
        let converged_at_s = until("1e-7").number("converged_at_s");
        assert!((converged_at_s - case.end.conv_time_s).abs() <= 0.0101, "{what}: {converged_at_s} s");

        let end = until("1e-13");
        assert_positions(&what, &end, &case.end.final_positions, TOLERANCE_M);
        let close = |ours: f64, theirs: f64| (ours / theirs - 1.0).abs() < 1e-9;
        assert!(close(end.rows::<Row>("metrics.csv")[0].cost_h, case.end.start_h), "{what}: H at the start");
        assert!(close(end.number("cost_h"), case.end.final_h), "{what}: H at the end");
        // The true error is small against the cell: 1e-10 of the cell's size is what quadrature gives.
        let true_error_m = end.number("mean_true_error_m");
        assert!((true_error_m - case.end.true_mean_error_final).abs() < 1e-10, "{what}: {true_error_m}");
    }
}

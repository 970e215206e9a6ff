//! Values that are not known are none: null, an empty cell, a broken line; never a zero that looks perfect.

#![allow(clippy::unwrap_used, reason = "these are tests, helpers included")]

use std::{
    fs,
    path::{Path, PathBuf},
    process::Output,
};

use serde_json::Value;
use tempfile::TempDir;
use tests::programs::{lamplight, said};

/// Eight robots by one lamp, which sense no walls.
const BASE: &str = r#"
    name = "base"
    duration_s = 5.0
    step_s = 0.1
    arena = { size_m = [2.0, 2.0], boundary_sensing = false }
    robots = { count = 8, radius_m = 0.05, speed_limit_m_per_s = 0.3 }
    field = { offset = 100.0, lamp = [{ position_m = [1.0, 0.0], peak = 500.0, half_distance_m = 0.5 }] }
    controller = { law = "linear", gain_per_s = 1.0, gradient = "fixed", gradient_magnitude_per_m = 1000.0 }
    channel = { model = "range", range_m = 1.0 }
"#;

/// Two robots, of which those near the middle are killed; after five of eight starts one is left.
const PAIR: &str = r#"
    name = "pair"
    duration_s = 5.0
    step_s = 0.1
    arena = { size_m = [2.0, 2.0], boundary_sensing = true }
    robots.count = 2
    field.offset = 1.0
    controller.gain_per_s = 1.0
    channel.model = "voronoi"
    fault = [{ kind = "kill", at_s = 2.0, region = { center_m = [1.0, 1.0], radius_m = 0.6 } }]
"#;

/// Three robots that sense walls, and nothing to cover.
const DARK: &str = r#"
    name = "dark"
    duration_s = 2.0
    step_s = 0.1
    arena = { size_m = [1.0, 1.0], boundary_sensing = true }
    robots.count = 3
    controller.gain_per_s = 1.0
    channel.model = "voronoi"
"#;

const KILL_ALL: &str = r#"fault=[{ kind = "kill", at_s = 1, robots = "0-7" }]"#;

struct Case {
    folder: TempDir,
    scenario: PathBuf,
}

impl Case {
    fn of(text: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let scenario = folder.path().join("scenario.toml");
        fs::write(&scenario, text).unwrap();
        Self { folder, scenario }
    }

    fn out(&self) -> PathBuf {
        self.folder.path().join("out")
    }

    /// A run in process, which ends as it should.
    fn run(&self, args: &[&str]) -> Left {
        let output = self.lamplight("run", &["--engine", "in-process", "--out"], args);
        assert!(output.status.success(), "{args:?}: {}", said(&output));
        let summary = fs::read_to_string(self.out().join("summary.json")).unwrap();
        Left { summary: serde_json::from_str(&summary).unwrap(), output }
    }

    fn lamplight(&self, command: &str, before: &[&str], args: &[&str]) -> Output {
        let mut lamplight = lamplight([command]);
        lamplight.arg(&self.scenario).args(before);
        if before.last() == Some(&"--out") {
            lamplight.arg(self.out());
        }
        lamplight.args(args).output().unwrap()
    }

    /// A column of a table of what was left; an empty cell is `None`.
    fn column(&self, file: &str, column: &str) -> Vec<Option<f64>> {
        column_of(&self.out().join(file), column)
    }
}

fn column_of(path: &Path, column: &str) -> Vec<Option<f64>> {
    let mut reader = csv::Reader::from_path(path).unwrap();
    let place = reader.headers().unwrap().iter().position(|name| name == column).unwrap();
    let cell = |row: csv::StringRecord| (!row[place].is_empty()).then(|| row[place].parse().unwrap());
    reader.records().map(|row| cell(row.unwrap())).collect()
}

/// Results of a run.
struct Left {
    summary: Value,
    output: Output,
}

impl Left {
    fn told(&self) -> String {
        String::from_utf8_lossy(&self.output.stdout).into_owned()
    }
}

/// Measures that have no value without any robot.
const MEASURES: [&str; 6] =
    ["mean_error_m", "max_error_m", "mean_true_error_m", "cost_h", "cell_agreement", "staleness_s"];

#[test]
fn where_nobody_is_left_there_is_no_error_and_no_cost() {
    let case = Case::of(BASE);
    let left = case.run(&["--set", KILL_ALL]);
    for measure in MEASURES {
        assert!(left.summary[measure].is_null(), "{measure} is {}", left.summary[measure]);
        assert_eq!(case.column("metrics.csv", measure).last(), Some(&None), "{measure}");
    }
    assert_eq!((&left.summary["robots_alive"], &left.summary["hearing_components"]), (&0.into(), &0.into()));
    assert!(left.told().contains("\nmean error none, cost H none, not converged\n"), "{}", left.told());
    let recovered = &left.summary["faults"][0]["recovered"];
    assert!(recovered["mean_error_ticks"].is_null() && recovered["cost_h_ticks"].is_null());
    let report = lamplight(["report"]).arg(case.out()).output().unwrap();
    assert!(report.status.success(), "{}", said(&report));
}

#[test]
fn shrink_does_not_take_no_value_for_a_small_one() {
    let case = Case::of(&format!("{BASE}\n{KILL_ALL}"));
    let output = case.lamplight("shrink", &["--until", "not cost_h >= 80", "--out"], &[]);
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    let output = case.lamplight("shrink", &["--until", "cost_h < 80", "--out"], &[]);
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    assert!(String::from_utf8_lossy(&output.stderr).contains("cost_h is null"), "{}", said(&output));
}

#[test]
fn trials_in_which_nobody_is_left_are_left_out_of_statistics_and_counted() {
    let case = Case::of(PAIR);
    let output = case.lamplight("batch", &["--trials", "8", "--out"], &[]);
    assert!(output.status.success(), "{}", said(&output));
    let costs = case.column("trials.csv", "cost_h");
    let known: Vec<f64> = costs.iter().flatten().copied().collect();
    assert_eq!((costs.len(), known.len()), (8, 5), "{costs:?}");
    let summary: Value =
        serde_json::from_str(&fs::read_to_string(case.out().join("summary.json")).unwrap()).unwrap();
    let cost = &summary["settings"][0]["measures"]["cost_h"];
    assert_eq!((&cost["count"], &cost["none"]), (&5.into(), &3.into()));
    assert!((cost["mean"].as_f64().unwrap() - 1.335).abs() < 5e-3, "{cost}");
    let told = String::from_utf8_lossy(&output.stdout);
    assert!(told.contains("cost H (5 of 8 trials)"), "{told}");
    let report = lamplight(["report"]).arg(case.out()).output().unwrap();
    assert!(report.status.success(), "{}", said(&report));
    let page = fs::read_to_string(case.out().join("report.html")).unwrap();
    assert!(page.contains("(5 of 8)"), "the page says how many trials have no value");
}

#[test]
fn a_lone_deaf_survivor_has_no_error_and_has_not_recovered() {
    let case = Case::of(BASE);
    let left = case.run(&["--set", &KILL_ALL.replace("0-7", "0-6")]);
    assert_eq!((&left.summary["mean_error_m"], &left.summary["max_error_m"]), (&Value::Null, &Value::Null));
    assert_eq!(left.summary["robots_without_error"], 1);
    assert!(left.summary["cost_h"].is_number(), "its global cell is the arena");
    assert_eq!(case.column("metrics.csv", "robots_without_error").last(), Some(&Some(1.0)));
    assert!(left.summary["faults"][0]["recovered"]["mean_error_ticks"].is_null());
    assert!(left.told().contains("mean error not recovered"), "{}", left.told());
    assert!(left.told().contains("mean error none (robots that estimate none: 1)"));
    let errors = column_of(&case.out().join("robots.csv"), "error_m");
    assert!(errors.iter().all(Option::is_none), "{errors:?}");
}

#[test]
fn robots_that_hear_nobody_have_no_error_and_do_not_converge() {
    let left = Case::of(BASE).run(&["--set", "channel.range_m=1e-12", "--set", "convergence.stop=true"]);
    assert!(left.summary["mean_error_m"].is_null() && left.summary["converged_at_s"].is_null());
    assert_eq!(
        (&left.summary["robots_without_error"], &left.summary["ended"]),
        (&8.into(), &"finished".into())
    );
}

#[test]
fn a_swarm_in_the_dark_is_warned_of_and_does_not_converge() {
    let dark = Case::of(DARK);
    let lit_below = Case::of(BASE);
    for (case, args, robots) in [
        (&dark, &["--set", "convergence.stop=true"][..], 3),
        (&lit_below, &["--set", "arena.boundary_sensing=true", "--set", "field.offset=-1000"][..], 8),
    ] {
        let left = case.run(args);
        assert!(left.summary["converged_at_s"].is_null(), "{args:?}");
        assert!(left.summary["mean_true_error_m"].is_null(), "a cell without mass has no centroid");
        assert_eq!(left.summary["robots_without_error"], robots);
        assert_eq!(left.summary["robots_without_mass"], robots);
        let warned = String::from_utf8_lossy(&left.output.stderr).into_owned();
        assert!(warned.contains("the field is nowhere positive"), "{warned}");
        fs::remove_dir_all(case.out()).unwrap();
    }
    let checked = dark.lamplight("check", &[], &[]);
    assert!(String::from_utf8_lossy(&checked.stderr).contains("the field is nowhere positive"));
    let batch = dark.lamplight("batch", &["--trials", "3", "--out"], &[]);
    assert!(batch.status.success(), "{}", said(&batch));
    assert!(String::from_utf8_lossy(&batch.stderr).contains("the field is nowhere positive"));
    for tolerance in ["1e-3", "1e-7"] {
        for which in ["mean", "max"] {
            let column = format!("{which}_below_{tolerance}_s");
            assert_eq!(dark.column("trials.csv", &column), [None; 3], "{column}");
        }
    }
}

#[test]
fn paused_robots_are_alive_and_said_to_be_paused() {
    let case = Case::of(BASE);
    let pause = r#"fault=[{ kind = "pause", from_s = 1, until_s = 60, robots = "0-7" }]"#;
    let left = case.run(&["--set", pause, "--set", "output.poses_every_s=1"]);
    assert_eq!((&left.summary["robots_alive"], &left.summary["robots_paused"]), (&8.into(), &8.into()));
    assert!(left.told().contains("8 of 8 robots alive, 8 of them paused\n"), "{}", left.told());
    for file in ["robots.csv", "poses.csv"] {
        let text = fs::read_to_string(case.out().join(file)).unwrap();
        let last = text.lines().last().unwrap();
        let header = text.lines().next().unwrap().split(',').position(|name| name == "paused").unwrap();
        let cells: Vec<&str> = last.split(',').collect();
        assert_eq!((cells[header - 1], cells[header]), ("true", "true"), "{file}: {last}");
    }
    assert!(left.summary["cost_h"].is_null(), "nobody takes part");
}

#[test]
fn open_cells_are_counted_with_the_keys_that_close_them() {
    // The neighbors of the robot in the middle leave gaps just under and just over a half-turn.
    let text = r#"
        duration_s = 0.1
        step_s = 0.1
        arena = { size_m = [3.0, 3.0], boundary_sensing = false }
        robots = { radius_m = 0.05, speed_limit_m_per_s = 0.01, positions_m = [[1.5, 1.5], [0.5, 1.5], [2.5, 1.505]] }
        field.offset = 1.0
        controller.gain_per_s = 1.0
        channel.range_m = 1.2
    "#;
    let case = Case::of(text);
    let left = case.run(&[]);
    assert_eq!(left.summary["robots_with_open_cell"], 1, "{}", left.summary);
    let line = "open cells: 1, with goals farther away than the arena's diagonal; controller.cell_cap_m or \
                arena.boundary_sensing = true closes them\n";
    assert!(left.told().contains(line), "{}", left.told());
    let report = lamplight(["report"]).arg(case.out()).output().unwrap();
    assert!(report.status.success(), "{}", said(&report));
    let page = fs::read_to_string(case.out().join("report.html")).unwrap();
    assert!(page.contains("Open cells at the end: 1, with goals farther away"));
    fs::remove_dir_all(case.out()).unwrap();
    let batch = case.lamplight("batch", &["--trials", "2", "--out"], &[]);
    assert_eq!(case.column("trials.csv", "robots_with_open_cell"), [Some(1.0); 2], "{}", said(&batch));
    assert!(said(&batch).contains("robots with an open cell (controller.cell_cap_m or"), "{}", said(&batch));
    for closed in ["controller.cell_cap_m=1", "arena.boundary_sensing=true"] {
        fs::remove_dir_all(case.out()).unwrap();
        let left = case.run(&["--set", closed]);
        assert_eq!(left.summary["robots_with_open_cell"], 0, "{closed}");
        assert!(!left.told().contains("open cells"));
    }
}

#[test]
fn what_was_not_measured_is_said_not_to_be() {
    let output = Case::of(BASE).lamplight(
        "run",
        &["--duration", "1"],
        &["--set", KILL_ALL, "--set", "fault.0.at_s=0"],
    );
    let told = String::from_utf8_lossy(&output.stdout);
    assert!(told.contains("agents: cycle not measured\n"), "{}", said(&output));
    assert!(!told.contains("NaN"), "{told}");
}

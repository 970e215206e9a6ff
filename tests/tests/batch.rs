//! `lamplight batch`, as a user would use it: killed, resumed, misused, and compared between engines.

#![allow(clippy::unwrap_used, reason = "these are tests, helpers included")]

use std::{
    collections::BTreeMap,
    ffi::OsStr,
    fs,
    path::{Path, PathBuf},
    process::{Child, Command, Output, Stdio},
};

use rustix::process::{Pid, Signal};
use serde_json::{Value, json};
use tempfile::TempDir;
use tests::{
    live::{agents_of, arena_under, signal, wait_until},
    programs::{lamplight, program, said, scenario},
};

/// Files of a batch that keeps everything.
const FILES: [&str; 6] =
    ["batch.json", "errors.csv", "positions.csv", "scenario.toml", "summary.json", "trials.csv"];

fn batch(name: &str, out: &Path, args: &[&str]) -> Command {
    let file = scenario(name);
    let mut command =
        lamplight([OsStr::new("batch"), file.as_os_str(), OsStr::new("--out"), out.as_os_str()]);
    command.args(args);
    command
}

fn done(name: &str, out: &Path, args: &[&str]) -> Output {
    let output = batch(name, out, args).output().unwrap();
    assert!(output.status.success(), "{args:?}: {}", said(&output));
    output
}

/// Returns the error message of a refused command.
fn refused(name: &str, out: &Path, args: &[&str]) -> String {
    let output = batch(name, out, args).arg("--quiet").output().unwrap();
    assert_eq!(output.status.code(), Some(2), "{args:?}: {}", said(&output));
    String::from_utf8(output.stderr).unwrap()
}

fn contents(folder: &Path) -> BTreeMap<String, String> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap());
    entries
        .map(|entry| (entry.file_name().into_string().unwrap(), fs::read_to_string(entry.path()).unwrap()))
        .collect()
}

fn rows(folder: &Path) -> Vec<BTreeMap<String, String>> {
    let mut reader = csv::Reader::from_path(folder.join("trials.csv")).unwrap();
    reader.deserialize().collect::<Result<_, _>>().unwrap()
}

fn column(folder: &Path, name: &str) -> Vec<String> {
    rows(folder).iter().map(|row| row[name].clone()).collect()
}

fn numbers(folder: &Path, name: &str) -> Vec<f64> {
    column(folder, name).iter().map(|text| text.parse().unwrap()).collect()
}

struct Place(TempDir);

impl Place {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn out(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }
}

const SWEPT: [&str; 12] = [
    "--trials",
    "6",
    "--robots",
    "8,12",
    "--sweep",
    "controller.gain_per_s=2,5",
    "--duration",
    "6",
    "--set",
    "step_s=0.02",
    "--keep",
    "errors,positions",
];

#[test]
fn a_killed_batch_goes_on_to_the_same_bytes() {
    let place = Place::new();
    let (whole, broken) = (place.out("whole"), place.out("broken"));
    done("one-gaussian", &whole, &SWEPT);
    assert_eq!(contents(&whole).keys().map(String::as_str).collect::<Vec<_>>(), FILES);
    assert_eq!(rows(&whole).len(), 24);

    let mut killed = batch("one-gaussian", &broken, &SWEPT).arg("--quiet").spawn().unwrap();
    let lines = || fs::read_to_string(broken.join("trials.csv")).map_or(0, |text| text.lines().count());
    wait_until("some trials are done", || lines() > 5);
    killed.kill().unwrap();
    killed.wait().unwrap();
    done("one-gaussian", &broken, &SWEPT);
    assert_eq!(contents(&whole), contents(&broken));
}

#[test]
fn rows_that_were_cut_short_are_dropped_and_played_again() {
    let place = Place::new();
    let (whole, broken) = (place.out("whole"), place.out("broken"));
    done("one-gaussian", &whole, &SWEPT);
    for (file, keep) in
        [("trials.csv", 0.7), ("errors.csv", 0.4), ("positions.csv", 0.5), ("trials.csv", 0.01)]
    {
        done("one-gaussian", &broken, &SWEPT);
        let path = broken.join(file);
        let text = fs::read_to_string(&path).unwrap();
        fs::write(&path, &text[..(text.len() as f64 * keep) as usize]).unwrap();
        done("one-gaussian", &broken, &SWEPT);
        assert_eq!(contents(&whole), contents(&broken), "{file} cut to {keep}");
    }
}

/// `SWEPT` with another number of trials.
fn swept(trials: &'static str) -> Vec<&'static str> {
    [&[SWEPT[0], trials], &SWEPT[2..]].concat()
}

#[test]
fn a_batch_grows_to_the_bytes_of_one_that_was_played_at_once_wherever_it_is_killed() {
    let place = Place::new();
    let (whole, grown) = (place.out("whole"), place.out("grown"));
    done("one-gaussian", &whole, &SWEPT);
    done("one-gaussian", &grown, &swept("2"));
    let lines = || fs::read_to_string(grown.join("trials.csv")).map_or(0, |text| text.lines().count());
    for rows in [12, 18] {
        let mut killed = batch("one-gaussian", &grown, &SWEPT).arg("--quiet").spawn().unwrap();
        wait_until("it has grown by some trials", || lines() > rows);
        killed.kill().unwrap();
        killed.wait().unwrap();
        assert!(!grown.join("summary.json").exists(), "it would speak of fewer trials than there are");
    }
    let last = done("one-gaussian", &grown, &SWEPT);
    assert!(said(&last).contains(" of 24 trials are done already"), "{}", said(&last));
    assert_eq!(contents(&whole), contents(&grown));

    let fewer = refused("one-gaussian", &grown, &swept("2"));
    assert!(fewer.contains("give --trials 6 or more"), "{fewer}");
    assert_eq!(contents(&whole), contents(&grown));
}

#[test]
fn a_grown_batch_that_is_killed_while_it_is_put_in_order_loses_nothing() {
    let place = Place::new();
    let (whole, grown) = (place.out("whole"), place.out("grown"));
    done("one-gaussian", &whole, &SWEPT);
    done("one-gaussian", &grown, &SWEPT);
    // As they are before that: the last trials of each setting come last, and one table is in order already.
    for (file, drafted) in [("trials.csv", false), ("errors.csv", true), ("positions.csv", false)] {
        let path = grown.join(file);
        let text = fs::read_to_string(&path).unwrap();
        let (header, rows) = text.split_once('\n').unwrap();
        let is_late = |row: &&str| row.split(',').nth(1).unwrap().parse::<u32>().unwrap() >= 4;
        let (late, early): (Vec<&str>, Vec<&str>) = rows.lines().partition(is_late);
        let mixed = [vec![header], early, late].concat().join("\n") + "\n";
        match drafted {
            false => fs::write(&path, mixed).unwrap(),
            true => fs::write(grown.join("errors.csv.draft"), &mixed[..mixed.len() / 2]).unwrap(),
        }
    }
    fs::remove_file(grown.join("summary.json")).unwrap();
    let last = done("one-gaussian", &grown, &SWEPT);
    assert!(said(&last).contains("24 of 24 trials are done already"), "{}", said(&last));
    assert_eq!(contents(&whole), contents(&grown));
}

/// A batch of processes long enough to be disturbed, while it goes on.
struct Disturbed {
    batch: Child,
    /// Agents that have been killed or stopped, by process.
    struck: Vec<Pid>,
}

const LONG: [&str; 8] = ["--trials", "2", "--robots", "4", "--duration", "1000", "--engine", "processes"];

impl Disturbed {
    fn start(out: &Path) -> Self {
        let batch = batch("swarmbots", out, &LONG)
            .args(["--keep", "errors", "--quiet"])
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        Self { batch, struck: Vec::new() }
    }

    /// Sends a signal to robot 2 of a swarm that has not had one yet, once it is at work.
    fn apply_process_faults(&mut self, how: Signal) {
        let mut agent = None;
        wait_until("a new swarm is at work", || {
            let agents = arena_under(&self.batch).map_or_else(BTreeMap::new, |(name, _)| agents_of(&name));
            agent = agents.get(&2).copied().filter(|pid| agents.len() == 4 && !self.struck.contains(pid));
            agent.is_some_and(|pid| context_switches(pid) > 300)
        });
        signal(agent.unwrap(), how);
        self.struck.push(agent.unwrap());
    }

    fn end(self) -> Output {
        self.batch.wait_with_output().unwrap()
    }
}

/// How often a process has waited: an agent that has joined does once per tick.
fn context_switches(pid: Pid) -> u64 {
    let status = fs::read_to_string(format!("/proc/{}/status", pid.as_raw_pid())).unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("voluntary_ctxt_switches:"));
    line.and_then(|count| count.trim().parse().ok()).unwrap_or(0)
}

#[test]
fn a_trial_that_lost_agents_is_played_again_and_left_out_if_it_loses_some_again() {
    let place = Place::new();
    let (whole, lossy) = (place.out("whole"), place.out("lossy"));
    let args = [&LONG[..], &["--keep", "errors"]].concat();
    done("swarmbots", &whole, &args);

    let mut once = Disturbed::start(&lossy);
    once.apply_process_faults(Signal::KILL);
    let output = once.end();
    assert!(output.status.success(), "{}", said(&output));
    assert!(said(&output).contains("trial 0 of setting 0 (seed 1) is played again by a new swarm: robot 2"));
    assert_eq!(contents(&whole), contents(&lossy));

    fs::remove_dir_all(&lossy).unwrap();
    let mut orphaned = Disturbed::start(&lossy);
    let arena = || arena_under(&orphaned.batch);
    wait_until("the arena is there", || arena().is_some());
    signal(arena().unwrap().1, Signal::KILL);
    // The next swarm has an arena of its own, and loses a robot as well.
    orphaned.apply_process_faults(Signal::KILL);
    let output = orphaned.end();
    assert!(said(&output).contains("is played again by a new swarm: the arena ended"), "{}", said(&output));
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    assert_eq!(column(&lossy, "ended"), ["lost-agents", "finished"]);

    fs::remove_dir_all(&lossy).unwrap();
    let mut twice = Disturbed::start(&lossy);
    twice.apply_process_faults(Signal::STOP);
    twice.apply_process_faults(Signal::KILL);
    let output = twice.end();
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    assert!(
        said(&output).contains(
            "error: 1 of 2 trials lost agents each time they were played, and are left out of the statistics: \
             trial 0 of setting 0 (seed 1); what did it is told above; if it was an accident, the same command \
             plays them again"
        ),
        "{}",
        said(&output)
    );
    assert_eq!(column(&lossy, "ended"), ["lost-agents", "finished"]);
    assert_eq!(column(&lossy, "mean_error_m")[0], "", "it has no numbers");
    let summary: Value = serde_json::from_str(&contents(&lossy)["summary.json"]).unwrap();
    let setting = &summary["settings"][0];
    assert_eq!(setting["ended"], json!({ "finished": 1, "lost-agents": 1 }));
    assert_eq!(setting["measures"]["cost_h"]["count"], 1);

    let report = lamplight([OsStr::new("report"), lossy.as_os_str()]).output().unwrap();
    assert!(report.status.success(), "{}", said(&report));
    let page = fs::read_to_string(lossy.join("report.html")).unwrap();
    assert!(page.contains("1 of 2 trials lost agents each time they were played, and are left out"));
    fs::remove_file(lossy.join("report.html")).unwrap();
    fs::remove_dir_all(lossy.join("figures")).unwrap();

    let again = done("swarmbots", &lossy, &args);
    assert!(said(&again).contains("1 of 2 trials are done already"), "{}", said(&again));
    assert_eq!(contents(&whole), contents(&lossy));
}

#[test]
fn a_finished_batch_is_not_played_again() {
    let place = Place::new();
    let out = place.out("b");
    let args = ["--trials", "2", "--duration", "1"];
    let first = done("one-gaussian", &out, &args);
    let modified = || fs::metadata(out.join("trials.csv")).unwrap().modified().unwrap();
    let before = modified();
    let again = done("one-gaussian", &out, &args);
    assert_eq!(first.stdout, again.stdout);
    assert!(said(&again).contains("2 of 2 trials are done already"), "{}", said(&again));
    assert_eq!(modified(), before);
}

#[test]
fn both_engines_fill_the_same_rows() {
    let place = Place::new();
    let args =
        ["--trials", "3", "--robots", "5,9", "--duration", "4", "--keep", "errors,positions", "--exact"];
    let gains = ["--sweep", "controller.gain_per_s=1,5"];
    let (inside, processes) = (place.out("in-process"), place.out("processes"));
    let all = [args.as_slice(), &gains].concat();
    done("one-gaussian", &inside, &all);
    done("one-gaussian", &processes, &[all.as_slice(), &["--engine", "processes"]].concat());
    for file in ["trials.csv", "errors.csv", "positions.csv", "scenario.toml"] {
        assert_eq!(contents(&inside)[file], contents(&processes)[file], "{file}");
    }
}

#[test]
fn processes_that_a_plan_has_killed_are_replaced_before_the_next_trial() {
    let place = Place::new();
    let fault = "fault=[{ kind = \"kill\", at_s = 1, restart_at_s = 2, robots = \"3\" }, \
                 { kind = \"pause\", from_s = 1, until_s = 2, robots = \"4\" }]";
    let args = ["--trials", "3", "--duration", "3", "--set", fault];
    let (inside, processes) = (place.out("in-process"), place.out("processes"));
    done("swarmbots", &inside, &args);
    done("swarmbots", &processes, &[args.as_slice(), &["--engine", "processes"]].concat());
    assert_eq!(column(&inside, "digest"), column(&processes, "digest"));
}

#[test]
fn trials_of_other_payloads_and_time_outs_are_runs_of_their_own() {
    const SET: [&str; 2] = ["channel.payload_bytes_max", "processes.hang_timeout_s"];
    let place = Place::new();
    let file = place.0.path().join("talkers.toml");
    let text = format!(
        "duration_s = 1\nstep_s = 0.1\narena.size_m = [2, 2]\nrobots.count = 4\nchannel.range_m = 1\n\
         [[controller]]\nprogram = [{:?}]\nparams = {{ payload_bytes = 20 }}\n",
        program("scripted-agent")
    );
    fs::write(&file, text).unwrap();
    let output = |command: &mut Command| {
        let output = command.output().unwrap();
        assert!(output.status.success(), "{}", said(&output));
    };
    let single = |payload: &str, timeout: &str| {
        let out = place.out(&format!("run-{payload}-{timeout}"));
        let set = [format!("{}={payload}", SET[0]), format!("{}={timeout}", SET[1])];
        output(
            lamplight(["run", "--quiet", "--set", &set[0], "--set", &set[1], "--out"]).arg(&out).arg(&file),
        );
        let summary: Value =
            serde_json::from_str(&fs::read_to_string(out.join("summary.json")).unwrap()).unwrap();
        summary["digest"].as_str().unwrap().to_owned()
    };
    // Nobody is heard where 20 bytes are too many.
    let (deaf, all) = (single("9", "2"), single("64", "1"));
    assert_ne!(deaf, all);
    for (payloads, expected) in [("9,64", [&deaf, &deaf, &all, &all]), ("64,9", [&all, &all, &deaf, &deaf])] {
        let out = place.out(&format!("batch-{payloads}"));
        let sweeps = [format!("{}={payloads}", SET[0]), format!("{}=2,1", SET[1])];
        let mut command = lamplight(["batch", "--quiet", "--trials", "1", "--engine", "processes"]);
        output(command.args(["--sweep", &sweeps[0], "--sweep", &sweeps[1], "--out"]).arg(&out).arg(&file));
        assert_eq!(column(&out, "digest").iter().collect::<Vec<_>>(), expected, "{payloads}");
    }
}

#[test]
fn a_trial_is_the_run_of_its_seed() {
    let place = Place::new();
    let out = place.out("b");
    done("swarmbots", &out, &["--trials", "3", "--seed", "5", "--duration", "5"]);
    let run =
        tests::programs::Run::of("swarmbots", &["--engine", "in-process", "--seed", "7", "--duration", "5"]);
    let last = &rows(&out)[2];
    assert_eq!((last["seed"].as_str(), last["digest"].as_str()), ("7", run.digest()));
    assert_eq!(last["cost_h"].parse::<f64>().unwrap(), run.number("cost_h"));
    assert_eq!(last["mean_lamp_distance_m"].parse::<f64>().unwrap(), run.number("mean_lamp_distance_m"));
}

/// Ten robots, 60 trials; the reference implementation says 29.89 ± 5.86 s to 1e-7 and 11.3 s to 1e-4.
#[test]
fn table_1_comes_out_as_the_reference_has_it() {
    let place = Place::new();
    let out = place.out("b");
    done(
        "one-gaussian",
        &out,
        &["--trials", "60", "--duration", "400", "--set", "step_s=0.05", "--set", "convergence.stop=true"],
    );
    let mean = |column: &str| {
        let values = numbers(&out, column);
        values.iter().sum::<f64>() / values.len() as f64
    };
    let standard_error = 5.86 / 60_f64.sqrt();
    let (fine, coarse) = (mean("mean_below_1e-7_s"), mean("mean_below_1e-4_s"));
    assert!((fine - 29.89).abs() < 3.0 * standard_error, "{fine}");
    assert!((coarse - 11.3).abs() < 2.0, "{coarse}");
    // Where they end: one of the equilibria of ten robots.
    let equilibria = [3.420_331e-3, 3.421_782e-3, 3.489_632e-3];
    for cost in numbers(&out, "cost_h") {
        assert!(equilibria.iter().any(|known| (cost / known - 1.0).abs() < 1e-6), "H = {cost}");
    }
}

/// Twenty robots and two Gaussians: the reference has a ratio of 1.000000 where σ is 1/√2, and 1.05 to 1.12 where
/// it is 0.2.
#[test]
fn wide_gaussians_cost_the_linear_law_nothing_and_narrow_ones_some_percent() {
    let place = Place::new();
    let out = place.out("b");
    let sigma = "field.gaussian.*.sigma_m=0.7071067811865476,0.2";
    let args = ["--trials", "6", "--duration", "40", "--set", "step_s=0.05", "--exact", "--sweep", sigma];
    done("two-gaussians", &out, &args);
    let costs = numbers(&out, "cost_h").into_iter().zip(numbers(&out, "exact_cost_h"));
    let ratios: Vec<f64> = costs.map(|(linear, exact)| linear / exact).collect();
    let (wide, narrow) = ratios.split_at(6);
    // All but the slowest have settled by now.
    let settled = wide.iter().filter(|&ratio| (ratio - 1.0).abs() < 1e-6).count();
    assert!(settled >= 4 && wide.iter().all(|ratio| (ratio - 1.0).abs() < 1e-3), "{wide:?}");
    let mean = narrow.iter().sum::<f64>() / 6.0;
    assert!((1.05..1.12).contains(&mean), "{mean} from {narrow:?}");
}

#[test]
fn a_batch_of_something_else_is_refused_and_left_alone() {
    let place = Place::new();
    let out = place.out("b");
    let args = ["--trials", "2", "--duration", "1"];
    done("one-gaussian", &out, &args);
    let before = contents(&out);
    let other = refused("two-gaussians", &out, &args);
    assert!(other.contains("holds another batch") && other.contains("\"two-gaussians\" here"), "{other}");
    let robots = refused("one-gaussian", &out, &[&args[..], &["--robots", "10,12"]].concat());
    assert!(robots.contains("`robots` is [10] there and [10,12] here"), "{robots}");
    let fewer = refused("one-gaussian", &out, &["--trials", "1", "--duration", "1"]);
    assert!(
        fewer.contains("a batch of 2 trials, and --trials 1 is fewer; give --trials 2 or more"),
        "{fewer}"
    );
    let longer = refused("one-gaussian", &out, &["--trials", "2", "--duration", "2"]);
    assert!(longer.contains("`duration_s = 1.0` there and `duration_s = 2.0` here"), "{longer}");
    assert_eq!(contents(&out), before);
}

#[test]
fn a_folder_that_holds_a_run_is_refused_and_left_alone() {
    let place = Place::new();
    let out = place.out("run");
    let file = scenario("one-gaussian");
    let run = [OsStr::new("run"), file.as_os_str(), OsStr::new("--out"), out.as_os_str()];
    let output =
        lamplight(run).args(["--engine", "in-process", "--duration", "1", "--quiet"]).output().unwrap();
    assert!(output.status.success());
    let before = contents(&out);
    let error = refused("one-gaussian", &out, &["--trials", "2"]);
    assert!(error.contains("holds scenario.toml and no batch.json"), "{error}");
    assert_eq!(contents(&out), before);
}

#[test]
fn a_file_that_something_else_has_changed_is_not_taken_for_a_batch() {
    let place = Place::new();
    let out = place.out("b");
    let args = ["--trials", "3", "--duration", "1"];
    done("one-gaussian", &out, &args);
    let path = out.join("trials.csv");
    let text = fs::read_to_string(&path).unwrap();
    fs::write(&path, text.replace("\n0,1,2,", "\n0,1,9,")).unwrap();
    let error = refused("one-gaussian", &out, &args);
    assert!(error.contains("trials.csv, line 3: this is not trial 1 of setting 0"), "{error}");
}

#[test]
fn a_bad_batch_is_refused_before_anything_is_made() {
    let place = Place::new();
    let out = place.out("b");
    let cases: [(&[&str], &str); 12] = [
        (&["--trials", "0"], "invalid value '0' for '--trials <K>'"),
        (&["--trials", "2", "--robots", "10,0"], "--robots 0"),
        (
            &["--trials", "2", "--sweep", "field.ofset=1,2"],
            "unknown key `ofset` in [field]; did you mean `offset`?",
        ),
        (&["--trials", "2", "--sweep", "field.offset=1,x"], "--sweep field.offset=x: "),
        (&["--trials", "2", "--sweep", "seed=1,2"], "use --seed and --trials"),
        (&["--trials", "2", "--sweep", "field.offset=1", "--sweep", "field.offset=2"], "is given twice"),
        (&["--trials", "2", "--seed", "9007199254740991"], "beyond the highest seed, 9007199254740991"),
        (&["--trials", "999999999", "--robots", "2,3"], "are more than 1000000000 trials"),
        (&["--trials", "2", "--robots", "5,9,5"], "--robots: 5 is given twice"),
        (&["--trials", "2", "--keep", "errors,errors"], "--keep: errors is given twice"),
        (&["--trials", "2", "--sweep", "field.offset=2,2"], "--sweep field.offset: 2 is given twice"),
        (
            &["--trials", "2", "--sweep", "controller.gain_per_s=1,2,1.0"],
            "the values 1 and 1.0 come to the same scenario, which is given twice",
        ),
    ];
    for (args, expected) in cases {
        let error = refused("one-gaussian", &out, args);
        assert!(error.contains(expected), "{args:?}: {error}");
        assert!(!out.exists(), "{args:?}");
    }
}

#[test]
fn settings_that_remember_neighbors_for_different_times_are_told_and_can_be_made_alike() {
    let place = Place::new();
    let loss = ["--trials", "1", "--duration", "1", "--sweep", "channel.loss=0,0.5"];
    let warnings = |out: &str, args: &[&str]| {
        let output = done("swarmbots", &place.out(out), &[&loss[..], args, &["--quiet"]].concat());
        String::from_utf8(output.stderr).unwrap()
    };
    let told = warnings("a", &[]);
    let expected = "WARN controller.neighbor_timeout_cycles is 1 in some settings and 4 in others, as only some can \
                    lose packets; --set controller.neighbor_timeout_cycles=4 makes them alike\n";
    assert!(told.trim_start() == expected, "{told}");
    assert_eq!(warnings("b", &["--set", "controller.neighbor_timeout_cycles=4"]), "");
    let scenario = fs::read_to_string(place.out("b").join("scenario.toml")).unwrap();
    assert!(scenario.contains("\nneighbor_timeout_cycles = 4\n"), "{scenario}");
}

//! Disks that are full, and limits on the size of a file: what fits is whole, what does not is named, and nothing is in
//! the way of the next attempt.

#![allow(clippy::unwrap_used, reason = "these are tests, helpers included")]

use std::{
    ffi::OsStr,
    fs,
    path::Path,
    process::{Command, Output, Stdio},
};

use serde_json::Value;
use tempfile::TempDir;
use tests::{
    programs::{Run, lamplight, program, said, scenario},
    trace::Trace,
};

/// The units that POSIX gives `ulimit -f`.
const BLOCK: u64 = 512;

/// `lamplight` where no file may be larger than so many blocks.
fn limited<S: AsRef<OsStr>>(blocks: u64, args: impl IntoIterator<Item = S>) -> Command {
    let mut command = Command::new("sh");
    let script = format!("ulimit -f {blocks} && exec \"$@\"");
    command.args(["-c", &script, "sh"]).arg(program("lamplight")).args(args).stdin(Stdio::null());
    command
}

fn folder() -> TempDir {
    tempfile::tempdir().unwrap()
}

/// Standard error of a command that failed with status 1.
fn failed(output: &Output) -> String {
    assert_eq!(output.status.code(), Some(1), "{}", said(output));
    String::from_utf8(output.stderr.clone()).unwrap()
}

fn succeeded(output: &Output) {
    assert!(output.status.success(), "{}", said(output));
}

/// A table that ends with a whole row.
fn assert_is_whole(table: &Path) -> usize {
    assert!(fs::read(table).unwrap().ends_with(b"\n"), "{}", table.display());
    csv::Reader::from_path(table).unwrap().records().map(Result::unwrap).count()
}

/// Runs 50 robots for 30 s under a limit, which only the tables of poses and logs exceed, and sees that nothing but
/// these is lost.
fn assert_that_a_run_goes_on(engine: &str, blocks: u64) {
    let args = ["--engine", engine, "--duration", "30", "--set", "output.poses_every_s=0.1"];
    let whole = Run::of("swarmbots", &args);
    let folder = folder();
    let out = folder.path().join("out");
    let output = limited(blocks, [OsStr::new("run"), scenario("swarmbots").as_os_str()])
        .args(args)
        .args(["--quiet", "--json", "--out"])
        .arg(&out)
        .env("RUST_LOG", "warn,robot_agent=debug")
        .output()
        .unwrap();
    let errors = failed(&output);
    let bytes = blocks * BLOCK;
    let expected = format!(
        "cannot write {}: File too large (os error 27); no file may be larger than {bytes} bytes here; `ulimit -f \
         unlimited` lifts that limit",
        out.join("poses.csv").display()
    );
    assert!(errors.contains(&format!("{expected}; the run goes on, and the file ends here")), "{errors}");
    assert!(errors.lines().last().unwrap().starts_with(&format!("error: {expected}")), "{errors}");

    let told: Value = serde_json::from_slice(&output.stdout).unwrap();
    let kept: Value = serde_json::from_slice(&fs::read(out.join("summary.json")).unwrap()).unwrap();
    assert_eq!(told, kept);
    assert_eq!((&told["digest"], &told["ended"]), (&whole.digest().into(), &"finished".into()));
    assert!(told["unwritten"][0].as_str().unwrap().starts_with(&expected), "{told}");
    let poses = assert_is_whole(&out.join("poses.csv"));
    let all = assert_is_whole(&whole.file("poses.csv"));
    assert!(poses > 100 && poses < all, "{poses} of {all}");
    for table in ["metrics.csv", "robots.csv", "ledger.csv"] {
        assert_eq!(assert_is_whole(&out.join(table)), assert_is_whole(&whole.file(table)), "{table}");
    }
}

#[test]
fn a_run_in_process_is_not_lost_with_a_file_that_grows_too_large() {
    assert_that_a_run_goes_on("in-process", 100);
}

#[test]
fn a_run_of_processes_is_not_lost_with_a_file_that_grows_too_large() {
    assert_that_a_run_goes_on("processes", 300);
}

#[test]
fn the_rest_of_a_run_is_written_though_one_file_is_not() {
    let folder = folder();
    let out = folder.path().join("out");
    // Of 50 robots, robots.csv has more than 3 kB, and all other files less.
    let output = limited(6, [OsStr::new("run"), scenario("swarmbots").as_os_str()])
        .args(["--engine", "in-process", "--quiet", "--duration", "5", "--out"])
        .arg(&out)
        .output()
        .unwrap();
    let errors = failed(&output);
    assert!(
        errors.starts_with("error: cannot write ") && errors.contains("robots.csv: File too large"),
        "{errors}"
    );
    assert!(String::from_utf8_lossy(&output.stdout).starts_with("swarmbots: finished after 5.0 s"));
    let summary: Value = serde_json::from_slice(&fs::read(out.join("summary.json")).unwrap()).unwrap();
    assert_eq!(summary["unwritten"].as_array().unwrap().len(), 1);
    assert!((1..50).contains(&assert_is_whole(&out.join("robots.csv"))));
    assert_eq!(assert_is_whole(&out.join("metrics.csv")), 6);
    assert_is_whole(&out.join("ledger.csv"));
}

#[test]
fn a_run_that_cannot_begin_its_files_is_in_nobodys_way() {
    let folder = folder();
    let out = folder.path().join("out");
    let file = scenario("swarmbots");
    let args: Vec<&OsStr> = [
        "run".as_ref(),
        file.as_os_str(),
        "--engine=in-process".as_ref(),
        "--duration=1".as_ref(),
        "--out".as_ref(),
        out.as_os_str(),
    ]
    .into();
    let errors = failed(&limited(1, &args).output().unwrap());
    assert!(errors.contains("scenario.toml: File too large"), "{errors}");
    succeeded(&lamplight(&args).output().unwrap());
}

#[test]
fn a_trace_that_grows_too_large_opens_all_the_same() {
    let folder = folder();
    let path = folder.path().join("trace.json");
    let output = limited(300, [OsStr::new("run"), scenario("swarmbots").as_os_str()])
        .args(["--quiet", "--duration", "10", "--trace"])
        .arg(&path)
        .output()
        .unwrap();
    let errors = failed(&output);
    assert!(
        errors.contains("the trace ends here: cannot write ") && errors.contains("153600 bytes"),
        "{errors}"
    );
    assert!(String::from_utf8_lossy(&output.stdout).starts_with("swarmbots: finished after 10.0 s"));
    let trace = Trace::read(&path);
    assert!(trace.other["first_tick_left_out"].is_u64(), "{:?}", trace.other);
    assert!(trace.of("X").count() > 500, "what fits is there");
    assert!(trace.other["cycles_left_out"].as_u64().unwrap() > 1000, "{:?}", trace.other);
    assert!(fs::metadata(&path).unwrap().len() <= 300 * BLOCK);
}

#[test]
fn a_log_that_grows_too_large_ends_with_a_whole_line_and_the_run_with_status_1() {
    let folder = folder();
    let out = folder.path().join("out");
    let output = limited(300, [OsStr::new("run"), scenario("swarmbots").as_os_str()])
        .args(["--quiet", "--duration", "30", "--out"])
        .arg(&out)
        .env("RUST_LOG", "trace")
        .output()
        .unwrap();
    let errors = failed(&output);
    assert!(errors.contains("log.txt: File too large") && errors.contains("the rest of the log is left out"));
    assert!(String::from_utf8_lossy(&output.stdout).starts_with("swarmbots: finished after 30.0 s"));
    assert!(fs::read(out.join("log.txt")).unwrap().ends_with(b"\n"));
    assert_eq!(assert_is_whole(&out.join("robots.csv")), 50);
}

#[test]
fn processes_that_could_not_share_memory_are_refused_with_the_limit() {
    let output =
        limited(100, [OsStr::new("run"), scenario("swarmbots").as_os_str()]).arg("--quiet").output().unwrap();
    assert_eq!(output.status.code(), Some(2), "{}", said(&output));
    assert!(said(&output).contains("no file may be larger than 51200 bytes here"), "{}", said(&output));
    assert!(said(&output).contains("`ulimit -f unlimited` lifts that limit"), "{}", said(&output));
}

#[test]
fn a_batch_whose_first_write_fails_ends_with_status_1_and_goes_on_later() {
    let folder = folder();
    let [broken, whole] = ["broken", "whole"].map(|name| folder.path().join(name));
    let file = scenario("one-gaussian");
    let args: Vec<&OsStr> = [
        "batch".as_ref(),
        file.as_os_str(),
        "--trials=9".as_ref(),
        "--duration=1".as_ref(),
        "--out".as_ref(),
    ]
    .into();
    let errors = failed(&limited(0, &args).arg(&broken).output().unwrap());
    assert!(errors.contains("batch.json: File too large"), "{errors}");
    // Room for scenario.toml, and for the rows of some trials.
    let errors = failed(&limited(3, &args).arg(&broken).output().unwrap());
    assert!(errors.contains("trials.csv: File too large"), "{errors}");
    assert!(assert_is_whole(&broken.join("trials.csv")) > 0);
    for out in [&broken, &whole] {
        succeeded(&lamplight(&args).arg(out).output().unwrap());
    }
    for name in ["batch.json", "scenario.toml", "summary.json", "trials.csv"] {
        assert_eq!(fs::read(broken.join(name)).unwrap(), fs::read(whole.join(name)).unwrap(), "{name}");
    }
}

#[test]
fn what_a_shrink_has_found_is_told_though_it_cannot_be_saved() {
    let folder = folder();
    let (file, out) = (scenario("swarmbots"), folder.path().join("small.toml"));
    let args: Vec<&OsStr> = [
        "shrink".as_ref(),
        file.as_os_str(),
        "--until=robots_alive > 3".as_ref(),
        "--duration=2".as_ref(),
        "--out".as_ref(),
        out.as_os_str(),
    ]
    .into();
    let output = limited(1, &args).output().unwrap();
    let errors = failed(&output);
    assert!(errors.contains("small.toml: File too large"), "{errors}");
    let told = String::from_utf8(output.stdout).unwrap();
    assert!(told.contains("4 of 50 robots still show it") && told.contains("count = 4"), "{told}");
    assert!(!out.exists());
    succeeded(&lamplight(&args).output().unwrap());
    assert!(told.ends_with(&fs::read_to_string(out).unwrap()), "it is the same");
}

#[test]
fn a_page_that_does_not_fit_leaves_the_one_before() {
    let run = Run::of("swarmbots", &["--engine", "in-process", "--duration", "2"]);
    let page = run.file("report.html");
    let report = [OsStr::new("report"), page.parent().unwrap().as_os_str()];
    let errors = failed(&limited(8, report).output().unwrap());
    assert!(errors.contains("File too large"), "{errors}");
    assert!(!page.exists());
    succeeded(&lamplight(report).output().unwrap());
    let before = fs::read(&page).unwrap();
    failed(&limited(8, report).output().unwrap());
    assert_eq!(fs::read(&page).unwrap(), before);
}

/// Runs `script`, to which a disk of 64 kB is `$1` and lamplight `$2`; `None` where no disk can be mounted.
fn on_a_small_disk(script: &str, args: &[&OsStr]) -> Option<Output> {
    let disk = folder();
    let mount = "mount -t tmpfs -o size=64k small \"$1\"";
    let unshared = |script: &str| {
        let mut command = Command::new("unshare");
        command.args(["--map-root-user", "--mount", "sh", "-c", script, "sh"]);
        command.arg(disk.path()).arg(program("lamplight")).args(args).stdin(Stdio::null()).output()
    };
    let can = unshared(mount).is_ok_and(|output| output.status.success());
    if !can {
        eprintln!("skipped: no file system can be mounted here");
        return None;
    }
    Some(unshared(&format!("{mount} && {script}")).unwrap())
}

#[test]
fn a_run_on_a_full_disk_keeps_its_summary_and_says_what_is_incomplete() {
    let file = scenario("swarmbots");
    // Room for two pages of 4 kB beside the folder: scenario.toml, and the header and first rows of poses.csv.
    let script = "head -c 49152 /dev/zero > \"$1/other\"; \
                  \"$2\" run \"$3\" --engine in-process --quiet --duration 9 --set output.poses_every_s=1 --out \"$1/out\"; \
                  echo \"status $?\"; tail -c 1 \"$1/out/poses.csv\" | od -An -c; rm -r \"$1/out\" \"$1/other\"; \
                  \"$2\" run \"$3\" --engine in-process --quiet --duration 1 --out \"$1/out\" > \"$1/told\"; echo \"status $?\"";
    let Some(output) = on_a_small_disk(script, &[file.as_os_str()]) else { return };
    let (told, errors) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(told.starts_with("swarmbots: finished after 9.0 s"), "{}", said(&output));
    assert!(errors.contains("poses.csv: No space left on device (os error 28); make room"), "{errors}");
    assert!(told.contains("status 1\n  \\n\nstatus 0\n"), "{}", said(&output));
}

#[test]
fn a_disk_that_other_results_fill_has_room_for_the_summary() {
    let file = scenario("swarmbots");
    let script = "head -c 16384 /dev/zero > \"$1/other\"; \
                  \"$2\" run \"$3\" --engine in-process --quiet --duration 60 --set output.metrics_every_s=0.1 --out \"$1/out\" \
                  > \"$1/told\"; echo \"status $?\"; cat \"$1/out/summary.json\"";
    let Some(output) = on_a_small_disk(script, &[file.as_os_str()]) else { return };
    let told = String::from_utf8_lossy(&output.stdout);
    let summary = told.strip_prefix("status 1\n").unwrap_or_else(|| panic!("{}", said(&output)));
    let summary: Value =
        serde_json::from_str(summary).unwrap_or_else(|error| panic!("{error}: {}", said(&output)));
    let incomplete = summary["unwritten"][0].as_str().unwrap();
    assert!(incomplete.contains("metrics.csv: No space left on device"), "{incomplete}");
}

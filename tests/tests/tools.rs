//! One agent under the tools of docs/profiling.md, in a run that does not mind.

#![allow(clippy::unwrap_used, reason = "these are tests, helpers included")]

use std::path::{Path, PathBuf};

use tests::{
    live::LiveRun,
    programs::{Run, program, said, under},
};

const OPTIONS: [&str; 4] = ["--robots", "4", "--duration", "5"];

/// The agent as cargo builds it.
fn plain() -> PathBuf {
    program("robot-agent")
}

/// The static agent, if `scripts/build` has built it.
fn lean() -> Option<PathBuf> {
    Some(plain().with_file_name("static").join("robot-agent")).filter(|agent| agent.is_file())
}

/// A run in which robot 3 is driven by `agent` under `tool` goes as it would without.
fn runs_under(tool: &[&str], agent: &Path) {
    let Some(mut command) = under(tool) else { return };
    let patient = ["--by-hand", "3", "--set", "processes.hang_timeout_s=100"];
    let run = LiveRun::start("swarmbots", &[&OPTIONS[..], &patient].concat());
    run.wait_until_open();
    let driven = run.agent_under(command.arg(agent), 3).wait_with_output().unwrap();
    let (output, left) = run.finish();
    assert!(output.status.success() && driven.status.success(), "{}\n{}", said(&output), said(&driven));
    let left = left.unwrap();
    let alone = Run::of("swarmbots", &[&OPTIONS[..], &["--engine", "in-process"]].concat());
    assert_eq!((left.digest(), &left.summary["robots_alive"]), (alone.digest(), &4.into()));
}

#[test]
fn an_agent_runs_under_valgrind_and_touches_nothing_it_must_not() {
    runs_under(&["valgrind", "--error-exitcode=99", "--quiet"], &plain());
    // Valgrind cannot take the place of a static C library, and holds what that does for errors.
    lean().iter().for_each(|agent| runs_under(&["valgrind", "--quiet"], agent));
}

#[test]
fn an_agent_runs_under_callgrind_gdb_strace_and_perf() {
    let folder = tempfile::tempdir().unwrap();
    let file = |option: &str, name: &str| format!("{option}{}", folder.path().join(name).display());
    let (calls, samples, traced) =
        (file("--callgrind-out-file=", "c"), file("--output=", "p"), file("", "s"));
    for agent in [Some(plain()), lean()].into_iter().flatten() {
        runs_under(&["valgrind", "--tool=callgrind", "--quiet", &calls], &agent);
        runs_under(&["strace", "--follow-forks", "-o", &traced], &agent);
        runs_under(&["perf", "record", "--quiet", &samples], &agent);
        runs_under(&["gdb", "--batch", "--return-child-result", "-ex", "run", "--args"], &agent);
    }
}

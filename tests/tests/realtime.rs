//! Robots on their own timers: deadlines are counted for whom they belong to, and lateness is said.

#![allow(clippy::unwrap_used, reason = "these are tests, helpers included")]

use std::{process::Output, thread, time::Duration};

use rustix::process::Signal;
use tests::{
    live::{LiveRun, signal},
    programs::{Run, said},
};

/// Long enough that whoever sleeps through it is late by any measure.
const LONG: Duration = Duration::from_millis(1500);

#[test]
fn clocks_that_drift_and_jitter_carry_a_run() {
    let options = ["--mode", "realtime", "--duration", "3", "--set", "processes.clock_drift_ppm=20000"];
    let jitter = ["--set", "processes.timer_jitter_s=0.03", "--robots", "8"];
    let run = LiveRun::start("swarmbots", &[&options[..], &jitter].concat());
    let (output, left) = run.finish();
    assert!(output.status.success(), "{}", said(&output));
    let run = left.unwrap();
    let (agents, lag) = (&run.summary["agents"], &run.summary["lag"]);
    assert_eq!(run.summary["mode"], "realtime");
    assert_eq!(run.number("commands_refused"), 0.0);
    assert!(agents["cycles"].as_u64().unwrap() > 8 * 10, "{agents}");
    assert!(agents["period_jitter_us"]["p50"].as_f64().is_some(), "{agents}");
    assert!(agents["packet_latency_us"]["p50"].as_f64().is_some(), "{agents}");
    assert!(lag["ticks"].as_u64().unwrap() >= 29, "{lag}");
}

#[test]
fn whoever_is_stopped_has_missed_its_deadlines_and_nobody_else_is_blamed() {
    let options = ["--mode", "realtime", "--duration", "6", "--robots", "6"];
    let run = LiveRun::start("swarmbots", &options);
    run.wait_until_moving();
    // Before its first answer a robot has no deadlines.
    thread::sleep(LONG);
    let stopped = run.agents()[&3];
    signal(stopped, Signal::STOP);
    thread::sleep(LONG);
    signal(stopped, Signal::CONT);
    let (output, left) = run.finish();
    assert!(output.status.success(), "{}", said(&output));
    let run = left.unwrap();
    let missed: Vec<u64> = run.robots().iter().map(|robot| robot.missed_deadlines.unwrap()).collect();
    // Cycles of 0.1 s. On a busy machine others may miss some too.
    assert!(missed[3] >= 10, "{missed:?}");
    assert!(missed.iter().enumerate().all(|(robot, &count)| robot == 3 || count < missed[3]), "{missed:?}");
    assert_eq!(run.summary["agents"]["missed_deadlines"], missed.iter().sum::<u64>());
}

/// A run whose arena is stopped for a while once robots move, to its end.
fn with_its_arena_stopped(options: &[&str]) -> (Output, Option<Run>) {
    let run = LiveRun::start("swarmbots", options);
    run.wait_until_moving();
    let arena = run.arena().unwrap();
    signal(arena, Signal::STOP);
    thread::sleep(LONG);
    signal(arena, Signal::CONT);
    run.finish()
}

#[test]
fn an_arena_that_is_late_says_by_how_much_and_fails_if_so_asked() {
    for (overload, succeeds) in [("report", true), ("slow-clock", true), ("fail", false)] {
        let options = ["--mode", "realtime", "--duration", "5", "--robots", "4", "--overload", overload];
        let (output, left) = with_its_arena_stopped(&options);
        assert_eq!(output.status.success(), succeeds, "{overload}: {}", said(&output));
        assert!(said(&output).contains("does not keep up"), "{overload}: {}", said(&output));
        let lag = left.unwrap().summary["lag"].clone();
        let number = |key: &str| lag[key].as_f64().unwrap();
        assert!(number("late_ticks") >= 1.0 && number("behind_max_s") > 1.0, "{overload}: {lag}");
        if succeeds {
            // Half a second is made up for where that is allowed.
            let lost_s = number("behind_max_s") - if overload == "report" { 0.5 } else { 0.0 };
            assert!(number("lost_s") >= lost_s - 1e-6, "{overload}: {lag}");
        }
    }
}

#[test]
fn an_arena_that_was_stopped_does_not_take_robots_that_lost_their_cells_for_converged() {
    let options =
        ["--mode", "realtime", "--duration", "4", "--robots", "8", "--set", "convergence.stop=true"];
    let (output, left) = with_its_arena_stopped(&options);
    assert!(output.status.success(), "{}", said(&output));
    let summary = left.unwrap().summary;
    // What it converges to takes a minute.
    assert_eq!(summary["ended"], "finished", "{}", said(&output));
    assert!(summary["converged_at_s"].is_null());
}

//! A thousand processes.

#![allow(clippy::unwrap_used, reason = "these are tests, helpers included")]

use tests::{
    live::LiveRun,
    programs::{Run, said},
};

#[test]
fn a_thousand_processes_run_five_hundred_ticks_and_leave_nothing() {
    let options = ["--duration", "50", "--set", "processes.hang_timeout_s=60"];
    let run = LiveRun::start("thousand", &options);
    run.wait_until_moving();
    assert_eq!(run.agents().len(), 1000);
    let (output, left) = run.finish();
    assert!(output.status.success(), "{}", said(&output));
    let left = left.unwrap();
    assert_eq!(left.number("ticks"), 500.0);
    assert_eq!(left.number("robots_alive"), 1000.0);
    println!("start-up {:.2} s", left.number("start_up_s"));
    let in_process = Run::of("thousand", &[&options[..], &["--engine", "in-process"]].concat());
    assert_eq!(left.digest(), in_process.digest());
}

//! Ctrl-Z and `fg`: what belongs together stands still together and goes on where it was, and nobody is late for it.

#![allow(clippy::unwrap_used, reason = "these are tests, helpers included")]

use std::{
    fs::File,
    io::{Read, Write},
    os::unix::process::CommandExt,
    process::{Command, Stdio},
    thread,
    time::{Duration, Instant},
};

use rustix::{
    process::{Pid, Signal, kill_process_group},
    pty::{OpenptFlags, openpt, ptsname, unlockpt},
    termios::{LocalModes, Winsize, tcgetattr, tcsetwinsize},
};
use serde_json::Value;
use tests::{
    live::{LiveRun, descendants, signal, state, wait_until},
    programs::{Run, lamplight, said, scenario},
};

/// Longer than the time-outs of the runs here.
const STANDSTILL: Duration = Duration::from_millis(1500);

fn is_stopped(pid: Pid) -> bool {
    state(pid) == Some('T')
}

/// Does what Ctrl-Z does, and waits until `pid` and all below it stand still. Returns who that is.
fn stop(pid: Pid) -> Vec<Pid> {
    signal(pid, Signal::TSTP);
    wait_until("the job is stopped", || is_stopped(pid));
    let family = descendants(pid);
    wait_until("all below it are stopped", || family.iter().all(|pid| is_stopped(*pid)));
    family
}

/// Stops the job `pid` for longer than anybody would be waited for, and lets it go on.
fn stand_still(pid: Pid) {
    stop(pid);
    thread::sleep(STANDSTILL);
    signal(pid, Signal::CONT);
}

#[test]
fn a_run_stands_still_as_a_whole_and_goes_on_where_it_was() {
    let plan = "fault=[{ kind = \"pause\", from_s = 1, until_s = 39, robots = \"0-4\" }]";
    let course = ["--duration", "40", "--set", plan, "--set", "processes.hang_timeout_s=0.5"];
    let run = LiveRun::start("swarmbots", &[&course[..], &["--speed", "10"]].concat());
    run.wait_until_moving();
    let agents = run.agents();
    wait_until("the plan has paused five", || (0..5).all(|robot| is_stopped(agents[&robot])));
    let family = stop(run.supervisor());
    assert_eq!(family.len(), 51, "an arena and its agents");
    thread::sleep(STANDSTILL);
    signal(run.supervisor(), Signal::CONT);
    wait_until("the others go on", || (5..50).all(|robot| !is_stopped(agents[&robot])));
    wait_until("the arena goes on", || run.arena().is_some_and(|arena| !is_stopped(arena)));
    assert!((0..5).all(|robot| is_stopped(agents[&robot])), "who is paused by the plan stays so");
    stand_still(run.supervisor());
    let (output, left) = run.finish();
    assert!(output.status.success(), "{}", said(&output));
    let left = left.unwrap();
    assert_eq!(left.summary["incidents"], Value::Array(Vec::new()), "nobody is taken for hanging");
    let unbroken = Run::of("swarmbots", &[&course[..], &["--engine", "in-process"]].concat());
    assert_eq!(left.digest(), unbroken.digest());
    assert!(said(&output).contains("; the run goes on"), "{}", said(&output));
}

#[test]
fn nobody_is_late_for_joining_because_the_run_stood_still() {
    let course = ["--robots", "3", "--duration", "1"];
    let patience = ["--by-hand", "2", "--set", "processes.join_timeout_s=1.4"];
    let run = LiveRun::start("swarmbots", &[&course[..], &patience].concat());
    run.wait_until_open();
    stand_still(run.supervisor());
    let mut agent = run.agent(2);
    let (output, left) = run.finish();
    assert!(output.status.success() && agent.wait().unwrap().success(), "{}", said(&output));
    assert_eq!(left.unwrap().summary["robots_alive"], 3);
}

#[test]
fn in_real_time_a_standstill_is_time_lost() {
    let course = ["--robots", "8", "--mode", "realtime", "--duration", "4"];
    let run =
        LiveRun::start("swarmbots", &[&course[..], &["--set", "processes.hang_timeout_s=1.4"]].concat());
    run.wait_until_moving();
    stand_still(run.supervisor());
    let (output, left) = run.finish();
    assert!(output.status.success(), "{}", said(&output));
    let left = left.unwrap();
    assert_eq!(left.summary["incidents"], Value::Array(Vec::new()), "nobody is taken for hanging");
    assert_eq!(left.summary["robots_alive"], 8);
    let lost_s = left.summary["lag"]["lost_s"].as_f64().unwrap();
    assert!(lost_s >= STANDSTILL.as_secs_f64(), "{lost_s} s");
    assert!(said(&output).contains("the run stood still for "), "{}", said(&output));
}

#[test]
fn a_run_that_stands_still_can_be_ended() {
    let start = || {
        let run = LiveRun::start("swarmbots", &["--speed", "10", "--duration", "2000"]);
        run.wait_until_moving();
        stop(run.supervisor());
        run
    };
    let run = start();
    signal(run.supervisor(), Signal::TERM);
    signal(run.supervisor(), Signal::CONT);
    let (output, left) = run.finish();
    assert_eq!(output.status.code(), Some(143), "{}", said(&output));
    assert_eq!(left.unwrap().summary["ended"], "interrupted");
    let run = start();
    signal(run.supervisor(), Signal::KILL);
    wait_until("the arena has left", || run.arena().is_none());
    let (_, left) = run.finish();
    assert_eq!(left.unwrap().summary["ended"], "interrupted", "the arena still writes what there is");
}

#[test]
fn whoever_was_stopped_by_somebody_else_stays_so() {
    let course = ["--speed", "10", "--duration", "2000", "--set", "processes.hang_timeout_s=1000"];
    let run = LiveRun::start("swarmbots", &course);
    run.wait_until_moving();
    let agents = run.agents();
    signal(agents[&17], Signal::STOP);
    wait_until("it is stopped", || is_stopped(agents[&17]));
    stand_still(run.supervisor());
    wait_until("the others go on", || agents.iter().all(|(robot, pid)| *robot == 17 || !is_stopped(*pid)));
    wait_until("the arena goes on", || run.arena().is_some_and(|arena| !is_stopped(arena)));
    assert!(is_stopped(agents[&17]));
    signal(run.supervisor(), Signal::TERM);
    let (output, _) = run.finish();
    assert_eq!(output.status.code(), Some(143), "{}", said(&output));
}

#[test]
fn batches_and_fuzz_stand_still_with_the_runs_they_play() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let batch =
        ["--trials", "2", "--engine", "processes", "--duration", "600", "--out", out.to_str().unwrap()];
    let fuzz = ["--runs", "2", "--duration", "600"];
    for (command, options, least) in [("batch", &batch[..], 11), ("fuzz", &fuzz[..], 12)] {
        let mut job = lamplight([command, "--set", "processes.hang_timeout_s=0.5", "--robots", "10"])
            .args(options)
            .arg(scenario("swarmbots"))
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        let pid = Pid::from_child(&job);
        wait_until("agents are there", || descendants(pid).len() >= least);
        stand_still(pid);
        assert!(job.wait().unwrap().success(), "{command}");
    }
}

#[test]
fn a_run_that_is_stopped_while_agents_are_started_goes_on() {
    // A child that has not yet begun its own program still hears what its parent's terminal says.
    for delay_ms in (0..30).step_by(2) {
        let mut lamplight = lamplight(["run"]);
        lamplight.arg(scenario("swarmbots")).args(["--robots", "16", "--duration", "1", "--quiet"]);
        let mut job = lamplight.stdout(Stdio::null()).process_group(0).spawn().unwrap();
        let group = Pid::from_child(&job);
        thread::sleep(Duration::from_millis(delay_ms));
        kill_process_group(group, Signal::TSTP).unwrap();
        wait_until("it stands still", || is_stopped(group) || job.try_wait().unwrap().is_some());
        kill_process_group(group, Signal::CONT).unwrap();
        wait_until("it has ended", || job.try_wait().unwrap().is_some());
        assert!(job.wait().unwrap().success(), "stopped after {delay_ms} ms");
    }
}

#[test]
fn a_run_in_process_stops_like_any_program() {
    let course = ["--engine", "in-process", "--speed", "20", "--duration", "20"];
    let mut lamplight = lamplight(["run"]);
    lamplight.arg(scenario("swarmbots")).args(course).stdout(Stdio::null());
    // As a shell does it. In a group whose parent has no part in the session, the kernel drops the signal.
    let mut job = lamplight.process_group(0).spawn().unwrap();
    signal(Pid::from_child(&job), Signal::TSTP);
    wait_until("it is stopped", || is_stopped(Pid::from_child(&job)));
    signal(Pid::from_child(&job), Signal::CONT);
    assert!(job.wait().unwrap().success());
}

#[test]
fn whoever_watches_gives_the_terminal_back_and_takes_it_again() {
    let run = LiveRun::start("swarmbots", &["--speed", "10", "--duration", "2000"]);
    run.wait_until_moving();
    let mut ours =
        File::from(openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC).unwrap());
    unlockpt(&ours).unwrap();
    tcsetwinsize(&ours, Winsize { ws_row: 40, ws_col: 120, ws_xpixel: 0, ws_ypixel: 0 }).unwrap();
    let path = ptsname(&ours, Vec::new()).unwrap();
    let theirs = File::options().read(true).write(true).open(path.to_str().unwrap()).unwrap();
    let top = lamplight(["top", &run.name]);
    let mut watcher = Command::new("setsid")
        .arg("--ctty")
        .arg(top.get_program())
        .args(top.get_args())
        .stdin(theirs.try_clone().unwrap())
        .stdout(theirs.try_clone().unwrap())
        .spawn()
        .unwrap();
    let mut reader = ours.try_clone().unwrap();
    // Whoever shows something waits for a terminal that takes it.
    let shown = thread::spawn(move || {
        let mut part = [0; 4096];
        while reader.read(&mut part).is_ok_and(|read| read > 0) {}
    });
    let pid = Pid::from_child(&watcher);
    let is_raw = || !tcgetattr(&theirs).unwrap().local_modes.contains(LocalModes::ICANON);
    for by_key in [true, false] {
        wait_until("the terminal is taken", is_raw);
        match by_key {
            true => ours.write_all(b"\x1a").unwrap(),
            false => signal(pid, Signal::TSTP),
        }
        wait_until("it is stopped", || is_stopped(pid));
        assert!(!is_raw(), "a shell can be used");
        signal(pid, Signal::CONT);
    }
    wait_until("the terminal is taken again", is_raw);
    ours.write_all(b"q").unwrap();
    let asked = Instant::now();
    while watcher.try_wait().unwrap().is_none() && asked.elapsed() < Duration::from_secs(30) {
        thread::sleep(Duration::from_millis(10));
    }
    let left = watcher.try_wait().unwrap();
    let _ = watcher.kill();
    assert!(left.is_some_and(|status| status.success()), "{left:?}");
    assert!(!is_raw());
    drop((ours, theirs));
    shown.join().unwrap();
    signal(run.supervisor(), Signal::TERM);
    run.finish();
}

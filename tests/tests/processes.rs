//! Real processes: what happens when agents, arena and supervisor are killed, stopped, doubled or
//! told to end, and that nothing is ever left behind.

#![allow(clippy::unwrap_used, reason = "these are tests, helpers included")]

use std::{
    io::Read,
    process::{Output, Stdio},
    sync::atomic::{AtomicBool, Ordering},
    thread,
    time::Duration,
};

use rustix::process::{Pid, Signal};
use tests::{
    live::{LiveRun, signal, wait_until},
    programs::{Run, lamplight, said, scenario},
};

/// Slow enough to be disturbed, fast enough to wait for.
const PACED: [&str; 4] = ["--speed", "40", "--duration", "80"];

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn incidents(run: &Run) -> Vec<String> {
    let incidents = run.summary["incidents"].as_array().unwrap();
    incidents.iter().map(|incident| incident["what"].as_str().unwrap().to_owned()).collect()
}

fn disturbed(policy: &str) -> LiveRun {
    let policy = format!("processes.on_hang={policy}");
    let run = LiveRun::start("swarmbots", &[&PACED[..], &["--set", &policy]].concat());
    run.wait_until_moving();
    run
}

#[test]
fn a_swarm_goes_on_without_five_killed_agents_and_a_stopped_one() {
    let run = disturbed("exclude");
    let agents = run.agents();
    assert_eq!(agents.len(), 50);
    for robot in 0..5 {
        signal(agents[&robot], Signal::KILL);
    }
    signal(agents[&17], Signal::STOP);
    let (output, left) = run.finish();
    assert!(output.status.success(), "{}", said(&output));
    let left = left.unwrap();
    assert_eq!(left.summary["ended"], "finished");
    assert_eq!(left.summary["robots_alive"], 44);
    let robots = left.robots();
    assert!(robots.iter().all(|robot| robot.alive != (robot.robot < 5 || robot.robot == 17)));
    let incidents = incidents(&left);
    assert_eq!(incidents.len(), 6, "{incidents:?}");
    let pid = agents[&17].as_raw_pid();
    let named = incidents.iter().any(|what| {
        what.starts_with(&format!("robot 17 (pid {pid}) has not answered tick "))
            && what.contains(" for 2s; state: stopped; it is left out from tick ")
    });
    assert!(named, "{incidents:?}");
}

#[test]
fn killed_and_stopped_agents_are_restarted_as_new_lives() {
    let run = disturbed("restart");
    let agents = run.agents();
    for robot in 0..3 {
        signal(agents[&robot], Signal::KILL);
    }
    signal(agents[&10], Signal::STOP);
    let (output, left) = run.finish();
    assert!(output.status.success(), "{}", said(&output));
    let left = left.unwrap();
    assert_eq!(left.summary["robots_alive"], 50, "{}", said(&output));
    for robot in left.robots() {
        let lives = if robot.robot < 3 || robot.robot == 10 { 1 } else { 0 };
        assert_eq!(robot.incarnation, lives, "{robot:?}");
    }
}

#[test]
fn a_run_that_must_not_lose_anyone_fails_and_says_whom_it_lost() {
    let run = disturbed("fail");
    signal(run.agents()[&30], Signal::KILL);
    let (output, left) = run.finish();
    assert_eq!(output.status.code(), Some(1));
    assert_eq!(left.unwrap().summary["ended"], "failed");
    let lines: Vec<_> =
        stderr(&output).lines().filter(|line| line.starts_with("error")).map(str::to_owned).collect();
    assert_eq!(lines.len(), 1, "{}", said(&output));
    assert!(lines[0].starts_with("error: robot 30 (pid "), "{lines:?}");
    assert!(lines[0].contains(") died "), "{lines:?}");
}

#[test]
fn agents_leave_when_their_arena_is_killed() {
    let run = disturbed("exclude");
    signal(run.arena().unwrap(), Signal::KILL);
    let (output, left) = run.finish();
    assert_eq!(output.status.code(), Some(1));
    assert!(left.is_none());
    assert_eq!(stderr(&output), "error: the arena ended without a result (signal 9)\n");
}

#[test]
fn everyone_leaves_when_the_supervisor_is_killed() {
    let run = disturbed("exclude");
    signal(run.supervisor(), Signal::KILL);
    wait_until("the arena has left", || run.arena().is_none());
    let (_, left) = run.finish();
    assert_eq!(left.unwrap().summary["ended"], "interrupted", "the arena still writes what there is");
}

#[test]
fn agents_leave_a_run_that_lost_both_arena_and_supervisor_and_clean_removes_the_rest() {
    let run = disturbed("exclude");
    signal(run.supervisor(), Signal::KILL);
    signal(run.arena().unwrap(), Signal::KILL);
    wait_until("every agent has left", || run.agents().is_empty());
    let other = LiveRun::start("swarmbots", &PACED);
    other.wait_until_moving();
    let (mine, theirs) = (run.leftovers(), other.leftovers());
    assert!(!mine.is_empty());
    assert!(lamplight(["clean"]).output().unwrap().status.success());
    assert!(run.leftovers().is_empty(), "the dead run's rest is gone");
    assert_eq!(other.leftovers().len(), theirs.len(), "the live run's is not");
    let (output, _) = other.finish();
    assert!(output.status.success(), "{}", said(&output));
}

#[test]
fn signals_end_a_run_cleanly() {
    for (sent, status) in [(Signal::INT, 130), (Signal::TERM, 143)] {
        let run = disturbed("exclude");
        signal(run.supervisor(), sent);
        let (output, left) = run.finish();
        assert_eq!(output.status.code(), Some(status), "{}", said(&output));
        let left = left.unwrap();
        assert_eq!(left.summary["ended"], "interrupted");
        assert_eq!(left.robots().len(), 50);
    }
}

#[test]
fn a_signal_ends_a_run_that_still_waits_for_robots() {
    let run = LiveRun::start("swarmbots", &["--by-hand", "3"]);
    wait_until("all but one agent are there", || run.agents().len() == 49);
    signal(run.supervisor(), Signal::INT);
    let (output, _) = run.finish();
    assert_eq!(output.status.code(), Some(130), "{}", said(&output));
}

#[test]
fn a_signal_ends_a_run_with_a_stopped_agent_at_once() {
    let run = LiveRun::start("swarmbots", &["--speed", "40", "--set", "processes.hang_timeout_s=1000"]);
    run.wait_until_moving();
    signal(run.agents()[&3], Signal::STOP);
    signal(run.supervisor(), Signal::TERM);
    let (output, _) = run.finish();
    assert_eq!(output.status.code(), Some(143), "{}", said(&output));
}

#[test]
fn two_runs_of_one_scenario_live_side_by_side() {
    let runs = [LiveRun::start("swarmbots", &PACED), LiveRun::start("swarmbots", &PACED)];
    let digests = runs.map(|run| run.finish().1.unwrap().digest().to_owned());
    assert_eq!(digests[0], digests[1]);
}

#[test]
fn a_name_in_use_is_refused_and_its_run_unharmed() {
    let run = disturbed("exclude");
    let files = run.leftovers().len();
    let second = lamplight(["run", "--name", &run.name]).arg(scenario("swarmbots")).output().unwrap();
    assert_eq!(second.status.code(), Some(2));
    let expected = format!("error: a run named `{}` is alive; choose another name, or none\n", run.name);
    assert_eq!(stderr(&second), expected);
    assert_eq!(run.leftovers().len(), files, "the first run keeps what is its own");
    let (output, left) = run.finish();
    assert!(output.status.success(), "{}", said(&output));
    assert_eq!(left.unwrap().summary["robots_alive"], 50);
}

#[test]
fn of_two_runs_that_want_one_name_at_once_one_gets_it() {
    for _ in 0..5 {
        let name = format!("test-twins-{}", std::process::id());
        let start = || {
            let options = ["--robots", "3", "--duration", "3", "--speed", "10", "--quiet"];
            let mut command = lamplight(["run", "--name", &name]);
            command.arg(scenario("swarmbots")).args(options).stderr(Stdio::piped()).stdout(Stdio::piped());
            command.spawn().unwrap()
        };
        let outputs = [start(), start()].map(|twin| twin.wait_with_output().unwrap());
        let codes = outputs.each_ref().map(|output| output.status.code().unwrap());
        assert!(codes == [0, 2] || codes == [2, 0], "{} {}", said(&outputs[0]), said(&outputs[1]));
        let winner = outputs.iter().find(|output| output.status.success()).unwrap();
        assert!(String::from_utf8_lossy(&winner.stdout).contains("3 of 3 robots alive"), "{}", said(winner));
    }
}

#[test]
fn cleaning_up_harms_no_run_that_starts() {
    let done = AtomicBool::new(false);
    thread::scope(|scope| {
        scope.spawn(|| {
            while !done.load(Ordering::Relaxed) {
                assert!(lamplight(["clean"]).output().unwrap().status.success());
            }
        });
        for _ in 0..20 {
            let run = Run::of("swarmbots", &["--robots", "2", "--duration", "0.5"]);
            assert_eq!(run.summary["robots_alive"], 2);
        }
        done.store(true, Ordering::Relaxed);
    });
}

#[test]
fn a_swarm_that_has_lost_everyone_fails() {
    let run = disturbed("exclude");
    run.agents().into_values().for_each(|pid| signal(pid, Signal::KILL));
    let (output, left) = run.finish();
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    assert!(stderr(&output).ends_with("error: no robot is left\n"), "{}", said(&output));
    assert_eq!(left.unwrap().summary["ended"], "failed");
}

#[test]
fn two_signals_at_once_are_one_wish() {
    let run = disturbed("exclude");
    signal(run.supervisor(), Signal::TERM);
    signal(run.supervisor(), Signal::INT);
    let (output, left) = run.finish();
    assert!(matches!(output.status.code(), Some(130 | 143)), "{}", said(&output));
    assert_eq!(left.unwrap().summary["ended"], "interrupted");
}

#[test]
fn a_start_that_is_interrupted_says_nothing_of_every_robot() {
    let run = LiveRun::start("thousand", &["--robots", "200", "--quiet"]);
    wait_until("some agents are there", || run.agents().len() > 20);
    signal(run.supervisor(), Signal::INT);
    let (output, _) = run.finish();
    assert_eq!(output.status.code(), Some(130), "{}", said(&output));
    assert_eq!(stderr(&output), "");
}

#[test]
fn an_agent_started_by_hand_joins_the_run_that_waits_for_it() {
    let run = LiveRun::start("swarmbots", &["--duration", "2", "--by-hand", "7"]);
    run.wait_until_open();
    let mut agent = run.agent(7);
    let (output, left) = run.finish();
    assert!(output.status.success(), "{}", said(&output));
    assert!(agent.wait().unwrap().success());
    let same = Run::of("swarmbots", &["--duration", "2", "--engine", "in-process"]);
    assert_eq!(left.unwrap().digest(), same.digest());
}

#[test]
fn a_robot_driven_by_hand_is_restarted_by_hand() {
    let options =
        ["--by-hand", "7", "--set", "processes.on_hang=restart", "--speed", "40", "--duration", "160"];
    let run = LiveRun::start("swarmbots", &options);
    run.wait_until_open();
    let mut first = run.agent(7);
    run.wait_until_moving();
    first.kill().unwrap();
    first.wait().unwrap();
    let mut second = run.agent_reborn(7, 1);
    let (output, left) = run.finish();
    assert!(output.status.success(), "{}", said(&output));
    assert!(second.wait().unwrap().success());
    let left = left.unwrap();
    assert_eq!(left.summary["robots_alive"], 50);
    assert_eq!(left.robots()[7].incarnation, 1);
    let incidents = incidents(&left);
    assert_eq!(incidents.len(), 1, "{incidents:?}");
    assert!(incidents[0].ends_with("--robot 7 --incarnation 1"), "{incidents:?}");
}

#[test]
fn agents_of_a_dead_run_leave_although_its_name_lives_on() {
    let run = disturbed("exclude");
    let agents = run.agents();
    signal(run.supervisor(), Signal::KILL);
    signal(run.arena().unwrap(), Signal::KILL);
    let mut again = None;
    wait_until("the name is free", || {
        let mut command =
            lamplight(["run", "--quiet", "--speed", "10", "--robots", "2", "--name", &run.name]);
        let mut next =
            command.arg(scenario("swarmbots")).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        thread::sleep(Duration::from_millis(200));
        let goes_on = next.try_wait().unwrap().is_none();
        again = Some(next);
        goes_on
    });
    let mut again = again.unwrap();
    wait_until("the old agents have left", || {
        let alive = run.agents();
        agents.values().all(|old| alive.values().all(|pid| pid != old))
    });
    assert!(again.try_wait().unwrap().is_none(), "the new run goes on");
    signal(Pid::from_child(&again), Signal::TERM);
    assert_eq!(again.wait().unwrap().code(), Some(143));
    run.finish();
}

#[test]
fn a_second_agent_for_a_live_robot_is_told_so_and_changes_nothing() {
    let run = disturbed("exclude");
    let mut second = run.agent(7);
    assert_eq!(second.wait().unwrap().code(), Some(1));
    let mut message = String::new();
    second.stderr.take().unwrap().read_to_string(&mut message).unwrap();
    let expected = format!(
        "error: robot 7 is not driven by hand in run `{}`; to drive it, start a run with --by-hand 7\n",
        run.name
    );
    assert_eq!(message, expected);
    let (_, left) = run.finish();
    let alone = Run::of("swarmbots", &["--duration", "80", "--engine", "in-process"]);
    assert_eq!(left.unwrap().digest(), alone.digest());
}

#[test]
fn an_agent_without_a_run_is_told_how_to_start_one() {
    let output = std::process::Command::new(tests::programs::program("robot-agent"))
        .args(["--run", "nobody", "--robot", "1"])
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(1));
    let expected =
        "error: no run named `nobody` is alive; start one with `lamplight run SCENARIO --name nobody`\n";
    assert_eq!(stderr(&output), expected);
}

#[test]
fn robots_on_their_own_timers_gather_too() {
    let run = Run::of("swarmbots", &["--mode", "realtime", "--duration", "4"]);
    assert_eq!(run.summary["mode"], "realtime");
    assert_eq!(run.summary["robots_alive"], 50);
    assert_eq!(run.number("ticks"), 40.0);
    assert!(
        run.summary["converged_at_s"].is_null(),
        "robots that have not sensed yet are not at their goals"
    );
    let still = Run::of("swarmbots", &["--engine", "in-process", "--duration", "0.1"]);
    let distance = |run: &Run| run.number("mean_lamp_distance_m");
    assert!(distance(&run) < distance(&still) - 0.02, "{} m", distance(&run));
}

//! The fault plan on real processes: who is to be killed dies, who is to be paused stops, new lives
//! begin, all of it at the very tick, and nothing grows.

#![allow(clippy::unwrap_used, reason = "these are tests, helpers included")]

use std::{fs, path::PathBuf, thread, time::Duration};

use rustix::process::{Pid, Signal};
use tempfile::TempDir;
use tests::{
    live::{LiveRun, descriptors, signal, state, wait_until},
    programs::{Run, said, scenario},
};

/// A scenario of the project with a fault plan.
struct Faulty {
    folder: TempDir,
}

impl Faulty {
    fn new(base: &str, faults: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let text = fs::read_to_string(scenario(base)).unwrap();
        let faulty = Self { folder };
        fs::write(faulty.path(), format!("{text}\n{faults}")).unwrap();
        faulty
    }

    fn path(&self) -> PathBuf {
        self.folder.path().join("faulty.toml")
    }

    /// Runs it to its end.
    fn run(&self, args: &[&str]) -> Run {
        Run::of(self.path().to_str().unwrap(), args)
    }

    /// Starts it in lock-step, slow enough to be watched.
    fn start(&self, args: &[&str]) -> LiveRun {
        LiveRun::start(self.path().to_str().unwrap(), args)
    }

    fn in_process(&self, duration_s: &str) -> Run {
        self.run(&["--engine", "in-process", "--duration", duration_s])
    }
}

fn kill(robots: &str, at_s: f64, restart_at_s: Option<f64>) -> String {
    let restart = restart_at_s.map_or(String::new(), |at_s| format!("restart_at_s = {at_s:?}\n"));
    format!("[[fault]]\nkind = \"kill\"\nrobots = \"{robots}\"\nat_s = {at_s:?}\n{restart}")
}

fn pause(robots: &str, from_s: f64, until_s: f64) -> String {
    format!(
        "[[fault]]\nkind = \"pause\"\nrobots = \"{robots}\"\nfrom_s = {from_s:?}\nuntil_s = {until_s:?}\n"
    )
}

fn assert_no_incident(run: &Run) {
    assert_eq!(run.summary["incidents"].as_array().unwrap().len(), 0, "{}", run.summary);
    assert_eq!(run.number("commands_refused"), 0.0);
}

#[test]
fn kills_pauses_and_restarts_give_one_digest_whoever_computes_it() {
    let faults = [
        kill("0-4", 2.0, Some(4.0)),
        kill("5-9", 3.0, None),
        pause("10-19", 1.0, 3.0),
        pause("15-24", 5.0, 20.0),
        kill("18, 30", 7.0, Some(7.1)),
        kill("0-2", 9.0, Some(12.0)),
        pause("40", 0.0, 1.0),
    ]
    .concat();
    let faulty = Faulty::new("swarmbots", &faults);
    for seed in ["1", "2"] {
        let options = ["--seed", seed, "--duration", "15"];
        let processes = faulty.run(&options);
        let in_process = faulty.run(&[&options[..], &["--engine", "in-process"]].concat());
        assert_eq!(processes.digest(), in_process.digest());
        let untroubled = Run::of("swarmbots", &[&options[..], &["--engine", "in-process"]].concat());
        assert_ne!(processes.digest(), untroubled.digest(), "the plan was carried out");
        assert_no_incident(&processes);
        let lives =
            |run: &Run| run.robots().iter().map(|robot| (robot.incarnation, robot.alive)).collect::<Vec<_>>();
        assert_eq!(lives(&processes), lives(&in_process));
        assert_eq!(lives(&processes)[0], (2, true));
        assert_eq!(lives(&processes)[5], (0, false));
    }
}

#[test]
fn a_planned_kill_is_a_real_death() {
    let faulty = Faulty::new("swarmbots", &kill("3", 4.0, None));
    let run = faulty.start(&["--speed", "4", "--duration", "16"]);
    wait_until("everyone is there", || run.agents().len() == 50);
    wait_until("robot 3 has died", || !run.agents().contains_key(&3));
    assert_eq!(run.agents().len(), 49, "the others live");
    let (output, left) = run.finish();
    assert!(output.status.success(), "{}", said(&output));
    let left = left.unwrap();
    assert_no_incident(&left);
    assert_eq!(left.summary["ended"], "finished");
    assert_eq!(left.summary["robots_alive"], 49);
    assert!(left.robots().iter().all(|robot| robot.alive == (robot.robot != 3)));
}

#[test]
fn a_planned_restart_is_a_new_process_and_a_new_life() {
    let faulty = Faulty::new("swarmbots", &kill("3", 4.0, Some(8.0)));
    let run = faulty.start(&["--speed", "4", "--duration", "16"]);
    wait_until("everyone is there", || run.agents().len() == 50);
    let first = run.agents()[&3];
    let second = || run.agents().get(&3).copied().filter(|pid| *pid != first);
    wait_until("robot 3 lives again", || second().is_some());
    let (output, left) = run.finish();
    assert!(output.status.success(), "{}", said(&output));
    let left = left.unwrap();
    assert_no_incident(&left);
    assert_eq!(left.summary["robots_alive"], 50);
    assert_eq!(left.robots()[3].incarnation, 1);
}

#[test]
fn a_planned_pause_is_a_stopped_process_that_goes_on_where_it_was() {
    // Four seconds of wall time: longer than an agent that is left out would stay.
    let faulty = Faulty::new("swarmbots", &pause("0-9", 4.0, 20.0));
    let run = faulty.start(&["--speed", "4", "--duration", "24"]);
    wait_until("everyone is there", || run.agents().len() == 50);
    let agents = run.agents();
    let stopped =
        || agents.iter().filter(|(_, pid)| state(**pid) == Some('T')).map(|(robot, _)| *robot).collect();
    let expected: Vec<u32> = (0..10).collect();
    wait_until("the paused ones are stopped, and nobody else", || {
        let stopped: Vec<u32> = stopped();
        stopped == expected
    });
    wait_until("they go on", || {
        let stopped: Vec<u32> = stopped();
        stopped.is_empty()
    });
    assert_eq!(run.agents(), agents, "they are the same processes");
    let (output, left) = run.finish();
    assert!(output.status.success(), "{}", said(&output));
    let left = left.unwrap();
    assert_no_incident(&left);
    assert_eq!(left.summary["robots_alive"], 50);
    assert_eq!(left.digest(), faulty.in_process("24").digest());
}

#[test]
fn a_swarm_that_the_plan_kills_entirely_finishes_without_anyone() {
    let faulty = Faulty::new("swarmbots", &kill("0-49", 2.0, None));
    let run = faulty.run(&["--duration", "10"]);
    assert_eq!(run.summary["ended"], "finished");
    assert_eq!(run.summary["robots_alive"], 0);
    assert_eq!(run.number("ticks"), 100.0);
    assert_no_incident(&run);
    assert_eq!(run.digest(), faulty.in_process("10").digest());
}

#[test]
fn a_swarm_that_is_paused_entirely_goes_on_after_that() {
    let faulty = Faulty::new("swarmbots", &pause("0-49", 2.0, 6.0));
    let run = faulty.run(&["--duration", "10"]);
    assert_eq!(run.summary["robots_alive"], 50);
    assert_no_incident(&run);
    assert_eq!(run.digest(), faulty.in_process("10").digest());
}

#[test]
fn five_hundred_restarts_leave_no_file_and_no_descriptor_behind() {
    const RESTARTS: u32 = 500;
    const ROBOTS: u32 = 100;
    /// More than two lives, which may be about to end or to begin when one looks, and far less than
    /// five hundred would leave.
    const FILES_IN_FLUX: usize = 100;
    const DESCRIPTORS_IN_FLUX: usize = 40;
    let faults: String = (0..RESTARTS)
        .map(|k| {
            let at_s = 1.0 + 0.2 * f64::from(k);
            kill(&(k % ROBOTS).to_string(), at_s, Some(at_s + 0.1))
        })
        .collect();
    // A cap on the speed, so that robots move before the first fault and the growth can be watched.
    let faulty = Faulty::new("hundred", &faults);
    let run = faulty.start(&["--speed", "20", "--duration", "103"]);
    run.wait_until_moving();
    let (arena, supervisor) = (run.arena().unwrap(), run.supervisor());
    let sizes = || [run.files(), descriptors(arena), descriptors(supervisor)];
    let (first, allowed) = (sizes(), [FILES_IN_FLUX, DESCRIPTORS_IN_FLUX, DESCRIPTORS_IN_FLUX]);
    let mut looks = 0;
    while run.arena().is_some() {
        let now = sizes();
        let grown = (0..3).any(|what| now[what] > first[what] + allowed[what]);
        assert!(!grown, "files, arena's and supervisor's descriptors: {first:?} -> {now:?}, look {looks}");
        looks += 1;
        thread::sleep(Duration::from_millis(200));
    }
    assert!(looks > 10, "it was watched");
    let (output, left) = run.finish();
    assert!(output.status.success(), "{}", said(&output));
    let left = left.unwrap();
    assert_no_incident(&left);
    assert_eq!(left.summary["robots_alive"], ROBOTS);
    assert!(left.robots().iter().all(|robot| u32::from(robot.incarnation) == RESTARTS / ROBOTS));
    // Every new life answered at the very tick at which it was planned to begin.
    let in_process = faulty.run(&["--engine", "in-process", "--duration", "103"]);
    assert_eq!(left.digest(), in_process.digest());
}

#[test]
fn robots_on_their_own_timers_are_killed_paused_and_restarted_too() {
    let faults =
        [kill("0-2", 1.0, Some(2.0)), kill("3", 2.0, None), pause("5-9", 1.0, 3.5), pause("20", 4.0, 60.0)]
            .concat();
    let run = Faulty::new("swarmbots", &faults).run(&["--mode", "realtime", "--duration", "6"]);
    assert_eq!(run.summary["ended"], "finished");
    assert_no_incident(&run);
    for robot in run.robots() {
        assert_eq!((robot.alive, robot.paused), (robot.robot != 3, robot.robot == 20), "{robot:?}");
        assert_eq!(robot.incarnation, u16::from(robot.robot < 3), "{robot:?}");
    }
}

#[test]
fn a_planned_restart_of_a_robot_driven_by_hand_waits_for_its_next_life() {
    let faulty = Faulty::new("swarmbots", &kill("7", 2.0, Some(4.0)));
    let run = faulty.start(&["--by-hand", "7", "--duration", "10"]);
    run.wait_until_open();
    let mut first = run.agent(7);
    // Virtual time stands until somebody starts the next life; the last one must not wait for it.
    assert_eq!(first.wait().unwrap().code(), Some(1), "it is told that the run goes on without it");
    let mut second = run.agent_reborn(7, 1);
    let (output, left) = run.finish();
    assert!(output.status.success(), "{}", said(&output));
    assert!(second.wait().unwrap().success());
    let told = String::from_utf8_lossy(&output.stderr).contains("--robot 7 --incarnation 1");
    assert!(told, "{}", said(&output));
    let left = left.unwrap();
    assert_no_incident(&left);
    assert_eq!(left.summary["robots_alive"], 50);
    assert_eq!(left.digest(), faulty.in_process("10").digest());
}

#[test]
fn a_run_ends_at_once_although_agents_are_paused() {
    let faulty = Faulty::new("swarmbots", &pause("0-9", 2.0, 1000.0));
    let run = faulty.start(&["--speed", "4", "--duration", "2000"]);
    wait_until("ten agents are stopped", || all_stopped(&run, 10));
    signal(run.supervisor(), Signal::TERM);
    let (output, left) = run.finish();
    assert_eq!(output.status.code(), Some(143), "{}", said(&output));
    assert_eq!(left.unwrap().summary["ended"], "interrupted");
}

#[test]
fn paused_agents_do_not_outlive_a_killed_supervisor() {
    let faulty = Faulty::new("swarmbots", &pause("0-9", 2.0, 1000.0));
    let run = faulty.start(&["--speed", "4", "--duration", "2000"]);
    wait_until("ten agents are stopped", || all_stopped(&run, 10));
    signal(run.supervisor(), Signal::KILL);
    wait_until("the arena has left", || run.arena().is_none());
    let (_, left) = run.finish();
    assert_eq!(left.unwrap().summary["ended"], "interrupted");
}

fn all_stopped(run: &LiveRun, count: usize) -> bool {
    let is_stopped = |pid: &Pid| state(*pid) == Some('T');
    run.agents().into_values().filter(is_stopped).count() == count
}

#[test]
fn who_was_lost_by_hand_before_is_not_counted_as_struck() {
    let plan = [pause("0-3", 40.0, 50.0), kill("0-3", 60.0, Some(70.0))].concat();
    let faulty = Faulty::new("swarmbots", &plan);
    let run = faulty.start(&["--speed", "40", "--duration", "80"]);
    run.wait_until_moving();
    signal(run.agents()[&2], Signal::KILL);
    let (output, left) = run.finish();
    assert!(output.status.success(), "{}", said(&output));
    let left = left.unwrap();
    assert_eq!(left.summary["robots_alive"], 49);
    for (fault, robots) in
        [(0, "robots paused"), (0, "robots resumed"), (1, "robots killed"), (1, "robots restarted")]
    {
        assert_eq!(left.summary["faults"][fault]["effects"][robots], 3, "{robots}");
    }
}

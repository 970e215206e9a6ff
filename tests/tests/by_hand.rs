//! Agents that users start: who is waited for, for how long, and what those are told who take the wrong place.

#![allow(clippy::unwrap_used, reason = "these are tests, helpers included")]

use std::process::{Command, Output, Stdio};

use tests::{
    live::{LiveRun, heard, wait_until},
    programs::{lamplight, program, said, scenario},
};

/// Output of an agent that leaves at once.
fn agent(run: &LiveRun, robot: &str, life: &str) -> Output {
    let place = ["--run", &run.name, "--robot", robot, "--incarnation", life];
    Command::new(program("robot-agent")).args(place).output().unwrap()
}

fn refused(run: &LiveRun, robot: &str, life: &str, expected: &str) {
    let output = agent(run, robot, life);
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    let message = String::from_utf8_lossy(&output.stderr).replace(&run.name, "RUN");
    assert_eq!(message, format!("error: {expected}\n"));
}

#[test]
fn who_is_waited_for_and_how_to_start_it_is_told_although_all_shall_be_quiet() {
    let mut run =
        LiveRun::start("swarmbots", &["-q", "--robots", "6", "--duration", "1", "--by-hand", "4,0-2"]);
    let line = run.hear("to be started by hand");
    let expected = format!(
        " WARN run `{run}` waits for robots 0-2,4 to be started by hand, each by its number: \
         robot-agent --run {run} --robot 0",
        run = run.name
    );
    assert_eq!(line, expected);
    let agents = [0, 1, 2, 4].map(|robot| run.agent(robot));
    let (output, _) = run.finish();
    assert!(output.status.success(), "{}", said(&output));
    for mut agent in agents {
        assert!(agent.wait().unwrap().success());
    }
}

#[test]
fn a_join_timeout_that_the_scenario_sets_holds_for_robots_driven_by_hand() {
    let limit =
        ["--robots", "3", "--by-hand", "2", "--duration", "1", "--set", "processes.join_timeout_s=0.2"];
    let (output, left) = LiveRun::start("swarmbots", &limit).finish();
    assert!(output.status.success(), "{}", said(&output));
    assert!(
        said(&output).contains("waits for robot 2 to be started by hand within 200ms: "),
        "{}",
        said(&output)
    );
    assert_eq!(left.unwrap().summary["robots_alive"], 2);
    let fail = [&limit[..], &["--set", "processes.on_hang=fail"]].concat();
    let (output, _) = LiveRun::start("swarmbots", &fail).finish();
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    assert!(
        said(&output).contains("error: robot 2 has not joined within 200ms; its program is robot-agent\n"),
        "{}",
        said(&output)
    );
}

#[test]
fn whoever_takes_the_wrong_place_is_told_the_right_one() {
    let options =
        ["--robots", "6", "--by-hand", "2,4", "--set", "processes.on_hang=restart", "--speed", "10"];
    let mut run = LiveRun::start("swarmbots", &[&options[..], &["--duration", "2000"]].concat());
    run.wait_until_open();
    refused(
        &run,
        "2",
        "1",
        "run `RUN` waits for robot 2 and not for robot 2 (life 2): robot-agent --run RUN --robot 2",
    );
    refused(
        &run,
        "5",
        "0",
        "robot 5 is not driven by hand in run `RUN`, which waits for robot 2: robot-agent --run RUN --robot 2",
    );
    let (mut second, mut fourth) = (run.agent(2), run.agent(4));
    run.wait_until_moving();
    refused(
        &run,
        "2",
        "0",
        "robot 2 already has an agent in run `RUN`; end that agent first, or drive another robot",
    );
    refused(
        &run,
        "2",
        "3",
        "run `RUN` does not wait for robot 2 (life 4); it is at robot 2, which has been started already",
    );
    refused(
        &run,
        "5",
        "0",
        "robot 5 is not driven by hand in run `RUN`; to drive it, start a run with --by-hand 5",
    );
    second.kill().unwrap();
    second.wait().unwrap();
    let line = run.hear("waits for robot 2 to be started by hand");
    assert!(line.ends_with("--robot 2 --incarnation 1"), "{line}");
    refused(
        &run,
        "2",
        "0",
        "run `RUN` waits for robot 2 (life 2) and not for robot 2: robot-agent --run RUN --robot 2 --incarnation 1",
    );
    tests::live::signal(run.supervisor(), rustix::process::Signal::TERM);
    run.finish();
    fourth.wait().unwrap();
}

#[test]
fn an_arena_alone_says_too_whom_it_waits_for() {
    let name = format!("test-alone-{}", std::process::id());
    let mut arena = Command::new(program("arena-daemon"))
        .args(["--name", &name, "--robots", "2", "--duration", "1", "--quiet"])
        .arg(scenario("swarmbots"))
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let line = heard(arena.stderr.as_mut().unwrap(), "to be started by hand");
    assert!(line.contains("robots 0-1") && line.ends_with(&format!("--run {name} --robot 0")), "{line}");
    let start = |robot: &str| {
        Command::new(program("robot-agent")).args(["--run", &name, "--robot", robot]).spawn().unwrap()
    };
    let mut agents = [start("0"), start("1")];
    wait_until("the run is over", || arena.try_wait().unwrap().is_some());
    assert!(arena.wait().unwrap().success());
    agents.iter_mut().for_each(|agent| assert!(agent.wait().unwrap().success()));
}

#[test]
fn what_names_no_robots_of_the_swarm_is_refused() {
    for bad in ["", "0-", "5-3", "a", "-1"] {
        let output =
            lamplight(["run", &format!("--by-hand={bad}")]).arg(scenario("swarmbots")).output().unwrap();
        assert_eq!(output.status.code(), Some(2), "{}", said(&output));
        assert!(said(&output).contains("--by-hand"), "{}", said(&output));
    }
    let output = lamplight(["run", "--by-hand=3,48-50"]).arg(scenario("swarmbots")).output().unwrap();
    assert!(
        said(&output).contains("--by-hand 3,48-50: the scenario has robots 0 to 49"),
        "{}",
        said(&output)
    );
}

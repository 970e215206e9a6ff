//! Agents are not trusted: the test itself drives one robot of a real run, and misbehaves.

#![allow(clippy::unwrap_used, reason = "these are tests, helpers included")]

use std::time::Duration;

use coverage::CoverageController;
use protocol::{
    codec,
    command::{Answer, Command},
    controller::{Controller, Hosted, StageObserver},
    frame::BodyVector,
    payload::Payload,
    percept::{Percept, Tick},
    robot_id::RobotId,
    setup::AgentSetup,
};
use rustix::process::{Signal, getpid};
use scenario::Scenario;
use tests::{
    live::{LiveRun, signal},
    programs::{Run, said, scenario},
};
use transport::{
    doorbell::{Doorbell, Ring},
    ends::AgentEnd,
    raw::{BOOT_TICK, RawCommand},
    run_dir::RunDir,
    services::{AgentPorts, Session},
};

/// Name of the run that an agent of ours joins, for the process that this test starts.
const RUN: &str = "LAMPLIGHT_TEST_RUN";

const ROBOT: RobotId = RobotId::first(3);
const OPTIONS: [&str; 2] = ["--duration", "2"];
/// With queues a lie is heard even if the truth follows at once; on a blackboard the truth may replace it.
const QUEUES: [&str; 2] = ["--set", "processes.plane=publish-subscribe"];
/// Others are killed, restarted and stopped, and packets are lost.
const UNDER_A_PLAN: [&str; 4] = [
    "--duration",
    "2",
    "--set",
    "fault=[{ kind = \"kill\", at_s = 0.5, restart_at_s = 1.0, robots = \"0-1\" }, \
     { kind = \"pause\", from_s = 0.7, until_s = 1.2, robots = \"5-6\" }, \
     { kind = \"loss\", probability = 0.3 }]",
];

/// Drives robot 3 of a run; `misbehave` sends what it likes beside the honest answer.
fn run_with(options: &[&str], misbehave: impl Fn(&mut AgentPorts, Tick, &Answer) -> Honesty) -> Run {
    run_booting(options, Answer::clone, misbehave)
}

/// The same by a robot whose first answer is what `boot` makes of the honest one.
fn run_booting(
    options: &[&str],
    boot: impl Fn(&Answer) -> Answer,
    misbehave: impl Fn(&mut AgentPorts, Tick, &Answer) -> Honesty,
) -> Run {
    let run = LiveRun::start("one-gaussian", &[options, &["--by-hand", "3"]].concat());
    run.wait_until_open();
    let (folder, _) = RunDir::open(run.name.parse().unwrap()).unwrap();
    let setup: AgentSetup = codec::decode(&std::fs::read(folder.setup_path()).unwrap()).unwrap();
    let bell = Doorbell::open(&folder.doorbell_path()).unwrap();
    let medium = Session::enter(&folder).unwrap();
    let mut ports = medium.join(ROBOT, setup.plane, setup.payload_bytes_max.into()).unwrap();
    let mut mind = Hosted::new(ROBOT, CoverageController::new(ROBOT, setup.params.decode().unwrap()));
    let mut seen = bell.round();
    folder.tell_note_names(ROBOT, &["misbehaves".into()]).unwrap();
    ports.send(raw(BOOT_TICK, &boot(&mind.boot())), &[], &[1.0]).unwrap();
    loop {
        match bell.wait_for_ring(seen, Duration::from_secs(60)) {
            Ring::Round(round) => seen = round,
            Ring::Closed => break,
            Ring::Silence => panic!("the arena is silent"),
        }
        let mut percept = Percept::empty(0);
        match ports.receive(&mut percept).unwrap() {
            None => continue,
            Some(read) => assert_eq!(read, Ok(0)),
        }
        let honest = mind.step(&percept, &mut ());
        if misbehave(&mut ports, percept.tick, &honest) == Honesty::AfterAll {
            send(&mut ports, raw(percept.tick, &honest));
        }
        bell.answer();
    }
    drop((ports, medium));
    let (output, left) = run.finish();
    assert!(output.status.success(), "{}", said(&output));
    left.unwrap()
}

#[derive(PartialEq)]
enum Honesty {
    AfterAll,
    Never,
}

fn raw(tick: Tick, answer: &Answer) -> RawCommand {
    RawCommand::new(tick, answer, &answer.packet().encode(), std::process::id())
}

/// Sends a command whose frame is short, or lies about that.
fn send(ports: &mut AgentPorts, command: RawCommand) {
    ports.send(command, &[], &[]).unwrap();
}

fn in_process(options: &[&str]) -> Run {
    Run::of("one-gaussian", &[options, &["--engine", "in-process"]].concat())
}

/// Lies told before the honest answer are refused, counted against their robot, and change nothing.
fn assert_harmless(what: &str, lie: impl Fn(Tick, &Answer) -> RawCommand) {
    assert_harmless_in(&OPTIONS, what, lie);
}

fn assert_harmless_in(options: &[&str], what: &str, lie: impl Fn(Tick, &Answer) -> RawCommand) {
    let truth = in_process(options);
    for plane in [&[][..], &QUEUES] {
        let run = run_with(&[options, plane].concat(), |ports, tick, honest| {
            send(ports, lie(tick, honest));
            Honesty::AfterAll
        });
        assert_eq!(run.digest(), truth.digest(), "{what}");
        let ticks = run.number("ticks") as u64 + 1;
        for robot in run.robots() {
            let lies = if robot.robot == ROBOT.index { ticks } else { 0 };
            let heard = if plane.is_empty() { 0..=lies } else { lies..=lies };
            assert!(heard.contains(&robot.commands_refused), "{what}: {robot:?}");
        }
    }
}

#[test]
fn stale_ticks_are_refused() {
    assert_harmless("stale", |tick, honest| raw(tick.wrapping_sub(1), honest));
}

#[test]
fn answers_to_ticks_to_come_are_refused() {
    assert_harmless("future", |tick, honest| raw(tick + 1, honest));
}

#[test]
fn another_incarnation_is_refused() {
    assert_harmless("incarnation", |tick, honest| RawCommand { incarnation: 1, ..raw(tick, honest) });
}

#[test]
fn another_robots_name_is_refused() {
    assert_harmless("name", |tick, honest| RawCommand { robot: 4, ..raw(tick, honest) });
}

#[test]
fn another_robots_packet_is_refused() {
    assert_harmless("packet", |tick, honest| {
        let forged = Answer { sender: RobotId::first(5), ..honest.clone() };
        RawCommand { robot: ROBOT.index, ..raw(tick, &forged) }
    });
}

#[test]
fn a_payload_longer_than_the_scenario_allows_is_refused() {
    assert_harmless("length", |tick, honest| {
        let mut long = raw(tick, honest);
        long.frame.len = u8::MAX;
        long
    });
    assert_harmless("payload", |tick, honest| raw(tick, &saying(&[7; 10], honest)));
}

/// A command that cannot be carried out, for some ticks: at boot its payload is too long, later it is no number, or no
/// number within reason.
fn misled(tick: Tick, command: &Command) -> Command {
    let nowhere = BodyVector::new(f64::NAN, 0.0);
    let command = command.clone();
    match tick {
        BOOT_TICK => Command { payload: Payload::from([7; 10]), ..command },
        30 => Command { velocity: nowhere, ..command },
        31 => Command { estimated_error: Some(nowhere), ..command },
        32 => Command { velocity: BodyVector::new(0.0, -1e13), ..command },
        _ => command,
    }
}

/// The paper's controller, but for what robot 3 is misled to.
struct Misled {
    id: RobotId,
    honest: CoverageController,
}

impl Misled {
    fn mislead(&self, tick: Tick, command: Command) -> Command {
        if self.id == ROBOT { misled(tick, &command) } else { command }
    }
}

impl Controller for Misled {
    fn boot(&mut self) -> Command {
        let command = self.honest.boot();
        self.mislead(BOOT_TICK, command)
    }

    fn step(&mut self, percept: &Percept, stages: &mut dyn StageObserver) -> Command {
        let command = self.honest.step(percept, stages);
        self.mislead(percept.tick, command)
    }
}

#[test]
fn commands_that_cannot_be_carried_out_are_refused_by_every_engine_alike() {
    let scenario = Scenario::load(&scenario("one-gaussian"), &["duration_s=2".parse().unwrap()]).unwrap();
    let new = engine::controller(|id, params| {
        params.decode().map(|setup| Misled { id, honest: CoverageController::new(id, setup) })
    });
    let truth = engine::run(&scenario, &[&new], &mut []).unwrap();
    assert_ne!(truth.digest, in_process(&OPTIONS).digest(), "nobody hears robot 3 at first");
    for plane in [&[][..], &QUEUES] {
        let mislead = |tick, honest: &Answer| Answer { command: misled(tick, &honest.command), ..*honest };
        let run = run_booting(
            &[&OPTIONS, plane].concat(),
            |honest| mislead(BOOT_TICK, honest),
            |ports, tick, honest| {
                send(ports, raw(tick, &mislead(tick, honest)));
                Honesty::Never
            },
        );
        assert_eq!(run.digest(), truth.digest);
        let refused: Vec<_> = run.robots().iter().map(|robot| robot.commands_refused).collect();
        assert_eq!(refused, [0, 0, 0, 4, 0, 0, 0, 0, 0, 0]);
    }
}

/// The same answer with another payload.
fn saying(payload: &[u8], answer: &Answer) -> Answer {
    let payload = Payload::try_from(payload).unwrap();
    Answer { command: Command { payload, ..answer.command }, ..*answer }
}

/// Whoever could not read it would lack a neighbor.
#[test]
fn a_long_payload_is_heard_where_the_scenario_allows_it() {
    let truth = in_process(&OPTIONS);
    for plane in [&[][..], &QUEUES] {
        let options = [&OPTIONS, plane, &["--set", "channel.payload_bytes_max=128"]].concat();
        let run = run_with(&options, |ports, tick, honest| {
            let long = saying(&[7; 128], honest);
            ports.send(raw(tick, &long), &long.packet().encode(), &[0.0]).unwrap();
            Honesty::Never
        });
        assert_eq!(run.digest(), truth.digest());
        assert_eq!(run.number("commands_refused"), 0.0);
    }
}

#[test]
fn flipped_bits_are_refused() {
    assert_harmless("checksum", |tick, honest| {
        let mut flipped = raw(tick, honest);
        flipped.frame.bytes[9] ^= 0x10;
        flipped
    });
}

#[test]
fn nan_is_refused() {
    assert_harmless("nan", |tick, honest| RawCommand { velocity_x_m_per_s: f64::NAN, ..raw(tick, honest) });
}

#[test]
fn lies_are_refused_while_others_die_and_come_back() {
    assert_harmless_in(&UNDER_A_PLAN, "under a plan", |tick, honest| RawCommand {
        incarnation: 1,
        ..raw(tick, honest)
    });
}

#[test]
fn a_flood_is_refused_and_drowns_nobody() {
    let truth = in_process(&OPTIONS);
    for plane in [&[][..], &QUEUES] {
        let run = run_with(&[&OPTIONS, plane].concat(), |ports, tick, honest| {
            for _ in 0..500 {
                send(ports, raw(tick, honest));
            }
            Honesty::AfterAll
        });
        assert_eq!(run.digest(), truth.digest());
        for robot in run.robots() {
            // A blackboard has room for the newest only.
            let floods = robot.robot == ROBOT.index;
            let counted = robot.commands_refused > 0;
            assert!(counted == floods || plane.is_empty() && floods, "{robot:?}");
        }
    }
}

#[test]
fn a_robot_that_answers_nothing_but_nan_stands_still_and_is_counted() {
    let nan = BodyVector::new(f64::NAN, 0.0);
    let run = run_with(&OPTIONS, |ports, tick, honest| {
        let command = Command { estimated_error: Some(nan), velocity: nan, ..honest.command.clone() };
        send(ports, raw(tick, &Answer { command, ..*honest }));
        Honesty::Never
    });
    let ticks = run.number("ticks") as u64 + 1;
    assert_eq!(run.number("commands_refused") as u64, ticks);
    assert_eq!((run.number("robots_alive"), run.number("robots_silent")), (10.0, 1.0));
    assert_eq!(run.summary["ended"], "finished");
}

/// Not a test of its own: the agent that dies in the next test.
#[test]
#[ignore = "it is the process that another test starts"]
fn an_agent_that_dies_as_it_joins() {
    let Ok(name) = std::env::var(RUN) else { return };
    let (folder, _) = RunDir::open(name.parse().unwrap()).unwrap();
    let setup: AgentSetup = codec::decode(&std::fs::read(folder.setup_path()).unwrap()).unwrap();
    let _ports =
        Session::enter(&folder).unwrap().join(ROBOT, setup.plane, setup.payload_bytes_max.into()).unwrap();
    signal(getpid(), Signal::KILL);
}

#[test]
fn an_agent_by_hand_that_dies_as_it_joins_is_not_waited_for() {
    for plane in ["blackboard", "publish-subscribe"] {
        let plane = format!("processes.plane={plane}");
        let run =
            LiveRun::start("one-gaussian", &[&OPTIONS[..], &["--by-hand", "3", "--set", &plane]].concat());
        run.wait_until_open();
        let joined = std::process::Command::new(std::env::current_exe().unwrap())
            .args(["--ignored", "--exact", "an_agent_that_dies_as_it_joins"])
            .env(RUN, &run.name)
            .output()
            .unwrap();
        assert!(joined.status.code().is_none(), "it is killed: {}", said(&joined));
        let (output, left) = run.finish();
        assert!(output.status.success(), "{}", said(&output));
        let incidents = left.unwrap().summary["incidents"].clone();
        assert_eq!(
            incidents[0]["what"], "the agent of robot 3 died as it joined; it is left out from here on",
            "{incidents}"
        );
    }
}

//! Our lock-step without an arena and without a controller: what our messages and checks cost.
//!
//! Services, doorbell, messages and checks are those of a run. A percept holds 8 deliveries, always the
//! same; every agent reads and checks it as a robot's does, and answers with a command that stands still.
//! The arena checks each command as a real one does.
//!
//! Contract: the run's folder and its shared memory go when the floor is dropped. If we are killed, nobody
//! holds the run's locks any more, and `lamplight clean` removes it.

use std::{
    io::{self, Read},
    process::{self, Command as Program, Stdio},
};

use anyhow::{Context, bail, ensure};
use clap::Args;
use protocol::{
    command::{Answer, Command},
    frame::BodyVector,
    packet::Packet,
    payload::SHORT_PAYLOAD_BYTES,
    percept::{Delivery, Percept},
    robot_id::RobotId,
    setup::Mode,
    units::{Meters, Radians},
};
use transport::{
    doorbell::{Doorbell, Ring},
    ends::{AgentEnd, ArenaEnd},
    footprint,
    frame_cache::Frames,
    raw::RawCommand,
    run_dir::{RunDir, RunLock, RunName},
    services::{AgentPorts, ArenaPorts, Session},
};

use super::{ALIVE_POLL, ANSWER_TIMEOUT, Floor, agents::Agents};
use crate::machine::{open_files, our_name};

/// The hidden subcommand.
pub(crate) const AGENT: &str = "idle-agent";

/// As many as every other floor's grant stands for.
const DELIVERIES: u32 = 8;

/// The arena's side: N agents that have joined a run of ours. Fields are dropped in this order, so that nobody
/// uses what is removed.
#[derive(Debug)]
pub(crate) struct Idle {
    _agents: Agents,
    robots: Vec<ArenaPorts>,
    _medium: Session,
    bell: Doorbell,
    percept: Percept,
    frames: Frames,
    _run: OwnRun,
}

/// Arguments of an agent.
#[derive(Args, Debug)]
pub(crate) struct AgentArgs {
    /// Name of the run
    run: RunName,
    /// Which robot we are
    robot: u32,
}

impl Idle {
    /// Starts `robots` agents and waits until all have joined.
    pub(crate) fn raise(robots: u32) -> anyhow::Result<Self> {
        let run = OwnRun::create()?;
        // Agents are started before there are any services, whose descriptors they would inherit. They
        // join once their input, which they share, has ended.
        let (gate, opener) = io::pipe()?;
        let mut agents = Agents::default();
        for index in 0..robots {
            let gate = Stdio::from(gate.try_clone()?);
            agents.start(AGENT, |command: &mut Program| {
                command.args([run.dir.name().to_string(), index.to_string()]).stdin(gate);
                command.stdout(Stdio::null());
            })?;
        }
        drop(gate);
        let medium = Session::enter(&run.dir)?;
        let plane = Mode::Lockstep.plane();
        let host =
            |index| medium.host(RobotId::first(index), plane, SHORT_PAYLOAD_BYTES).with_context(open_files);
        let members = (0..robots).map(host).collect::<Result<Vec<_>, _>>()?;
        let bell = Doorbell::create(&run.dir.doorbell_path()).context("cannot make the doorbell")?;
        bell.expect(robots);
        drop(opener);
        ensure!(bell.wait_for_answers(ANSWER_TIMEOUT), "the agents did not join in time");
        let frames = Frames::of(robots as usize);
        Ok(Self {
            _agents: agents,
            robots: members,
            _medium: medium,
            bell,
            percept: percept(),
            frames,
            _run: run,
        })
    }
}

impl Floor for Idle {
    fn tick(&mut self, number: u64) -> anyhow::Result<()> {
        self.percept.tick = number;
        for ports in &mut self.robots {
            ports.send(&self.percept, &mut self.frames)?;
        }
        self.bell.expect(self.robots.len() as u32);
        self.bell.ring();
        ensure!(self.bell.wait_for_answers(ANSWER_TIMEOUT), "an agent does not answer tick {number}");
        for (ports, index) in self.robots.iter_mut().zip(0..) {
            let robot = RobotId::first(index);
            // Without descriptors for its connection, the transport is silent.
            let silent = || format!("nothing is heard from {robot} at tick {number}; {}", open_files());
            let received = ports.receive()?.with_context(silent)?;
            received
                .check(robot, number, &mut self.frames)
                .with_context(|| format!("the command of {robot}"))?;
        }
        Ok(())
    }
}

/// A run that is removed when this is dropped.
#[derive(Debug)]
struct OwnRun {
    dir: RunDir,
    /// The owner's and the arena's.
    locks: Option<(RunLock, RunLock)>,
}

impl OwnRun {
    fn create() -> anyhow::Result<Self> {
        let (dir, owner) = RunDir::create(our_name().parse()?)?;
        let arena = dir.go_live()?;
        Ok(Self { dir, locks: Some((owner, arena)) })
    }
}

impl Drop for OwnRun {
    fn drop(&mut self) {
        let Some((owner, arena)) = self.locks.take() else { return };
        drop(arena);
        if let Err(error) = self.dir.remove_own(owner) {
            eprintln!("warning: {error}; `lamplight clean` removes what is left");
        }
    }
}

/// Darkness, and 8 neighbors around.
fn percept() -> Percept {
    let mut percept = Percept::empty(0);
    percept.deliveries.extend((0..DELIVERIES).map(|sender| Delivery {
        packet: Packet::short(RobotId::first(sender), 1, Some(100.0_f32.to_le_bytes())),
        range: Meters::new(0.5).expect("a finite length"),
        bearing: Radians::new(f64::from(sender) * 0.7).expect("a finite angle"),
        orientation: Radians::new(0.5).expect("a finite angle"),
    }));
    percept
}

/// An agent's life: wait until all is laid out, join, then wake, read, answer, sleep.
pub(crate) fn agent(args: &AgentArgs) -> anyhow::Result<()> {
    io::stdin().read_to_end(&mut Vec::new()).context("cannot wait for the run")?;
    let (run, arena) = RunDir::open(args.run.clone())?;
    let bell = Doorbell::open(&run.doorbell_path()).context("cannot open the doorbell")?;
    let id = RobotId::first(args.robot);
    let mut ports = Session::enter(&run)?.join(id, Mode::Lockstep.plane(), SHORT_PAYLOAD_BYTES)?;
    footprint::trim();
    let mut percept = Percept::empty(0);
    let (mut seen, pid) = (bell.round(), process::id());
    bell.answer();
    loop {
        match bell.wait_for_ring(seen, ALIVE_POLL) {
            Ring::Closed => return Ok(()),
            Ring::Round(round) => {
                seen = round;
                hear(&mut ports, &mut percept)?;
                let answer = stand_still(id, &percept);
                let frame = answer.packet().encode();
                ports.send(RawCommand::new(percept.tick, &answer, &frame, pid), &frame, &[])?;
                bell.answer();
            }
            Ring::Silence if arena.is_alive() => {}
            Ring::Silence => bail!("the arena has died; {id} leaves"),
        }
    }
}

/// Reads every percept that waits, as a robot's agent does; here it is one.
fn hear(ports: &mut AgentPorts, percept: &mut Percept) -> anyhow::Result<()> {
    let mut heard = false;
    while let Some(refused) = ports.receive(percept)? {
        ensure!(refused? == 0 && percept.deliveries.len() == DELIVERIES as usize, "a spoilt percept");
        heard = true;
    }
    ensure!(heard, "a ring without a percept");
    Ok(())
}

fn stand_still(sender: RobotId, percept: &Percept) -> Answer {
    let payload = 0.0_f32.to_le_bytes().into();
    let command = Command { estimated_error: Some(BodyVector::HERE), payload, ..Command::REST };
    Answer { sender, sequence: percept.tick as u32, command }
}

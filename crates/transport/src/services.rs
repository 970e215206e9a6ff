//! The iceoryx2 side of a run: the one module that touches it.
//!
//! Each life of a robot has two services of its own, one per direction, with its index and incarnation in
//! their names. One uplink for all would cost O(N²), because `receive` scans every connection. The incarnation
//! is in the name because a killed agent's port stays taken: its successor gets services of its own. One
//! reader and one writer at most keep a second agent from driving the same robot.
//!
//! There are two planes, which agree to the last bit: `blackboard` and `publish_subscribe`.

mod blackboard;
mod common;
mod publish_subscribe;

use std::{collections::BTreeSet, fs, path::Path, time::Duration};

use iceoryx2::{
    config::Config,
    node::{Node, NodeBuilder},
    prelude::{FileName, LogLevel, Path as IoxPath, SemanticString, SignalHandlingMode, ipc, set_log_level},
};

use common::failed;

use crate::{
    ends::{AgentEnd, ArenaEnd, Received, ServiceError},
    frame_cache::Frames,
    raw::{Beside, PerceptError, RawCommand, RawDelivery, RawLongDelivery},
    run_dir::RunDir,
};
use protocol::{
    notes::NOTES_MAX, payload::SHORT_PAYLOAD_BYTES, percept::Percept, robot_id::RobotId, setup::Plane,
};

/// How long opening a service waits for its creator, who on a busy machine may be slow.
const CREATION_TIMEOUT: Duration = Duration::from_secs(20);

/// One process's access to the services of one run.
#[derive(Debug)]
pub struct Session {
    node: Node<ipc::Service>,
}

/// The arena's ends of one robot's services.
#[derive(Debug)]
pub struct ArenaPorts {
    ends: ArenaEnds,
    payload_bytes_max: usize,
    /// Parts that came with the command that was received last.
    beside: Beside,
}

#[derive(Debug)]
enum ArenaEnds {
    Blackboard(blackboard::ArenaPorts),
    Queues(publish_subscribe::ArenaPorts<RawDelivery>),
    LongQueues(publish_subscribe::ArenaPorts<RawLongDelivery>),
}

/// An agent's ends of its services.
#[derive(Debug)]
pub struct AgentPorts(AgentEnds);

#[derive(Debug)]
#[expect(clippy::large_enum_variant, reason = "an agent has one, which stays where it is made")]
enum AgentEnds {
    Blackboard(blackboard::AgentPorts),
    Queues(publish_subscribe::AgentPorts<RawDelivery>),
    LongQueues(publish_subscribe::AgentPorts<RawLongDelivery>),
}

impl Session {
    /// Enters the run. Blocks for nothing but the file system.
    pub fn enter(run: &RunDir) -> Result<Self, ServiceError> {
        // Our own errors say what matters; iceoryx2 would print each of its steps.
        set_log_level(LogLevel::Fatal);
        let config = config(run)?;
        let node = NodeBuilder::new()
            .config(&config)
            .signal_handling_mode(SignalHandlingMode::Disabled)
            .create::<ipc::Service>()
            .map_err(|error| failed("enter the run's services")(&error))?;
        Ok(Self { node })
    }

    /// The arena makes the services of one life of a robot, for packets with payloads of up to so many bytes. They have
    /// room for as many deliveries as a percept may hold, however few robots there are: copies and late packets come on
    /// top. Shared memory is taken only where it is touched.
    pub fn host(
        &self,
        robot: RobotId,
        plane: Plane,
        payload_bytes_max: usize,
    ) -> Result<ArenaPorts, ServiceError> {
        use publish_subscribe::ArenaPorts as Queues;
        let ends = match plane {
            Plane::Blackboard => {
                ArenaEnds::Blackboard(blackboard::ArenaPorts::host(&self.node, robot, payload_bytes_max)?)
            }
            Plane::PublishSubscribe if payload_bytes_max > SHORT_PAYLOAD_BYTES => {
                ArenaEnds::LongQueues(Queues::host(&self.node, robot)?)
            }
            Plane::PublishSubscribe => ArenaEnds::Queues(Queues::host(&self.node, robot)?),
        };
        Ok(ArenaPorts { ends, payload_bytes_max, beside: Beside::default() })
    }

    /// An agent takes its place as `robot`, with what the arena has made its services with.
    pub fn join(
        &self,
        robot: RobotId,
        plane: Plane,
        payload_bytes_max: usize,
    ) -> Result<AgentPorts, ServiceError> {
        use publish_subscribe::AgentPorts as Queues;
        Ok(AgentPorts(match plane {
            Plane::Blackboard => {
                AgentEnds::Blackboard(blackboard::AgentPorts::join(&self.node, robot, payload_bytes_max)?)
            }
            Plane::PublishSubscribe if payload_bytes_max > SHORT_PAYLOAD_BYTES => {
                AgentEnds::LongQueues(Queues::join(&self.node, robot)?)
            }
            Plane::PublishSubscribe => AgentEnds::Queues(Queues::join(&self.node, robot)?),
        }))
    }
}

impl ArenaEnd for ArenaPorts {
    fn send(&mut self, percept: &Percept, frames: &mut Frames) -> Result<(), ServiceError> {
        match &mut self.ends {
            ArenaEnds::Blackboard(ports) => {
                ports.send(percept, frames);
                Ok(())
            }
            ArenaEnds::Queues(ports) => ports.send(percept, frames),
            ArenaEnds::LongQueues(ports) => ports.send(percept, frames),
        }
    }

    fn receive(&mut self) -> Result<Option<Received<'_>>, ServiceError> {
        let Self { ends, payload_bytes_max, beside } = self;
        let command = match ends {
            ArenaEnds::Blackboard(ports) => ports.receive(beside),
            ArenaEnds::Queues(ports) => ports.receive(beside)?,
            ArenaEnds::LongQueues(ports) => ports.receive(beside)?,
        };
        Ok(command.map(|command| Received {
            command,
            frame: &beside.frame.0,
            notes: &beside.notes[..usize::from(command.notes_len).min(NOTES_MAX)],
            payload_bytes_max: *payload_bytes_max,
        }))
    }
}

impl ArenaPorts {
    /// Whether a process that has opened the services has died without closing them.
    pub fn has_dead_agent(&self) -> bool {
        let dead = match &self.ends {
            ArenaEnds::Blackboard(ports) => ports.dead_nodes(),
            ArenaEnds::Queues(ports) => ports.dead_nodes(),
            ArenaEnds::LongQueues(ports) => ports.dead_nodes(),
        };
        !dead.is_empty()
    }

    /// Identifiers that the names of files carry which a killed agent has left; none if there was
    /// no agent, if it has left in order, or if it lives.
    fn marks(&self) -> BTreeSet<String> {
        match &self.ends {
            ArenaEnds::Blackboard(ports) => ports.marks(),
            ArenaEnds::Queues(ports) => ports.marks(),
            ArenaEnds::LongQueues(ports) => ports.marks(),
        }
    }
}

/// Lets go of `lives` that are over, and removes what their processes have left if they were
/// killed: nodes, data, ends of connections, and services that count the dead among their users.
/// What a process that still lives holds is not touched.
///
/// iceoryx2 removes a dead node too, but searches all files of a run several times for it: 3.8 ms at
/// 100 robots, and that grows with them. This goes through the files once for all `lives`: 1.2 ms
/// for one, 40 ms for all 100 at once.
pub fn remove_dead_files(run: &RunDir, lives: Vec<ArenaPorts>) {
    let marks: BTreeSet<String> = lives.iter().flat_map(ArenaPorts::marks).collect();
    drop(lives);
    if marks.is_empty() {
        return;
    }
    let shared_memory = run.path().parent().map(Path::to_path_buf).unwrap_or_default();
    let (prefix, nodes) = (run.prefix(), run.services_path().join("nodes"));
    for folder in [&shared_memory, &nodes, &run.services_path().join("services")] {
        for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
            let file_name = entry.file_name();
            let name = file_name.to_str().and_then(|name| name.strip_prefix(&prefix));
            if name.is_some_and(|name| name.split(['.', '_']).any(|part| marks.contains(part))) {
                let _ = fs::remove_file(entry.path());
            }
        }
    }
    for mark in marks {
        // Of these, only nodes have folders.
        let _ = fs::remove_dir_all(nodes.join(mark));
    }
}

impl AgentEnd for AgentPorts {
    fn receive(&mut self, percept: &mut Percept) -> Result<Option<Result<u32, PerceptError>>, ServiceError> {
        match &mut self.0 {
            AgentEnds::Blackboard(ports) => Ok(ports.receive(percept)),
            AgentEnds::Queues(ports) => ports.receive(percept),
            AgentEnds::LongQueues(ports) => ports.receive(percept),
        }
    }

    fn send(&mut self, mut command: RawCommand, frame: &[u8], notes: &[f64]) -> Result<(), ServiceError> {
        command.notes_len = notes.len() as u8;
        match &mut self.0 {
            AgentEnds::Blackboard(ports) => {
                ports.send(command, frame, notes);
                Ok(())
            }
            AgentEnds::Queues(ports) => ports.send(command, frame, notes),
            AgentEnds::LongQueues(ports) => ports.send(command, frame, notes),
        }
    }
}

fn config(run: &RunDir) -> Result<Config, ServiceError> {
    let doing = || failed("name the run's services");
    let mut config = Config::default();
    let root = run.services_path();
    let root = root.to_str().expect("a run's folder is ASCII");
    config.global.set_root_path(&IoxPath::new(root.as_bytes()).map_err(|error| doing()(&error))?);
    config.global.prefix = FileName::new(run.prefix().as_bytes()).map_err(|error| doing()(&error))?;
    config.global.creation_timeout = CREATION_TIMEOUT;
    // Looking for the dead costs seconds with hundreds of agents; the run removes its files by prefix.
    config.global.node.cleanup_dead_nodes_on_creation = false;
    config.global.node.cleanup_dead_nodes_on_destruction = false;
    config.global.service.cleanup_dead_nodes_on_open = false;
    // The default of 128 costs 450 KB of heap per subscriber.
    config.defaults.publish_subscribe.subscriber_expired_connection_buffer = publish_subscribe::BUFFERED;
    Ok(config)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conformance::{self, Subject};
    use protocol::command::{Answer, Command};

    fn run(what: &str) -> (RunDir, crate::run_dir::RunLock) {
        let name = format!("test-services-{what}-{}", std::process::id());
        RunDir::create(name.parse().unwrap()).unwrap()
    }

    const PLANES: [Plane; 2] = [Plane::Blackboard, Plane::PublishSubscribe];

    /// One of the planes of iceoryx2, in a run of its own.
    struct OfRun(RunDir, Plane);

    impl Subject for OfRun {
        type Arena = ArenaPorts;
        type Agent = AgentPorts;

        fn unread_max(&self) -> usize {
            match self.1 {
                Plane::Blackboard => 1,
                Plane::PublishSubscribe => publish_subscribe::BUFFERED,
            }
        }

        fn host(&self, life: RobotId, payload_bytes_max: usize) -> Result<ArenaPorts, ServiceError> {
            Session::enter(&self.0)?.host(life, self.1, payload_bytes_max)
        }

        fn join(&self, life: RobotId, payload_bytes_max: usize) -> Result<AgentPorts, ServiceError> {
            Session::enter(&self.0)?.join(life, self.1, payload_bytes_max)
        }
    }

    /// Holds a plane to the suite: if it passes, it can carry any run.
    fn conforms(plane: Plane) {
        let (run, owner) = run(if plane == Plane::Blackboard { "boards" } else { "queues" });
        let subject = OfRun(run, plane);
        conformance::check(&subject);
        subject.0.remove_own(owner).unwrap();
    }

    #[test]
    fn blackboards_conform() {
        conforms(Plane::Blackboard);
    }

    #[test]
    fn queues_conform() {
        conforms(Plane::PublishSubscribe);
    }

    /// Files of a run, its folder included.
    fn files(run: &RunDir) -> Vec<String> {
        fn below(folder: &std::path::Path, found: &mut Vec<String>) {
            for entry in std::fs::read_dir(folder).unwrap().flatten() {
                found.push(entry.path().display().to_string());
                if entry.path().is_dir() {
                    below(&entry.path(), found);
                }
            }
        }
        let mut found = Vec::new();
        below(run.path().parent().unwrap(), &mut found);
        let mark = format!("lamplight-{}", run.name());
        found.retain(|path| path.contains(&mark));
        found.sort();
        found
    }

    /// Not a test of its own: the agent that the next test kills.
    #[test]
    #[ignore = "it is the process that another test starts and kills"]
    fn an_agent_that_waits_to_be_killed() {
        let Ok(name) = std::env::var("LAMPLIGHT_TEST_RUN") else { return };
        let plane = PLANES[usize::from(std::env::var("LAMPLIGHT_TEST_PLANE").unwrap() != "0")];
        let run = RunDir::of(name.parse().unwrap());
        let mut agent = Session::enter(&run).unwrap().join(RobotId::first(0), plane, 0).unwrap();
        let answer = Answer { sender: RobotId::first(0), sequence: 0, command: Command::REST };
        let frame = answer.packet().encode();
        agent.send(RawCommand::new(0, &answer, &frame, 1), &frame, &[]).unwrap();
        std::thread::sleep(Duration::from_secs(60));
    }

    #[test]
    fn nothing_is_left_of_a_life_that_was_killed() {
        for (at, plane) in PLANES.into_iter().enumerate() {
            let (run, owner) = run("killed");
            let arena = Session::enter(&run).unwrap();
            let neighbor = arena.host(RobotId::first(1), plane, 0).unwrap();
            let before = files(&run);
            let mut ports = arena.host(RobotId::first(0), plane, 0).unwrap();
            let mut agent = std::process::Command::new(std::env::current_exe().unwrap())
                .args(["--ignored", "--exact", "services::tests::an_agent_that_waits_to_be_killed"])
                .env("LAMPLIGHT_TEST_RUN", run.name().to_string())
                .env("LAMPLIGHT_TEST_PLANE", at.to_string())
                .stdout(std::process::Stdio::null())
                .spawn()
                .unwrap();
            while ports.receive().unwrap().is_none() {
                assert_eq!(agent.try_wait().unwrap(), None, "the agent ended by itself");
                ports.send(&Percept::empty(0), &mut Frames::of(1)).unwrap();
                std::thread::sleep(Duration::from_millis(1));
            }
            agent.kill().unwrap();
            agent.wait().unwrap();
            assert!(files(&run).len() > before.len() + 10, "{plane:?}: it has left something");
            remove_dead_files(&run, Vec::new());
            assert!(files(&run).len() > before.len() + 10, "{plane:?}: its life is not said to be over yet");
            remove_dead_files(&run, vec![ports]);
            assert_eq!(files(&run), before, "{plane:?}");
            // The next life of the robot has room, though the dead one's place stays taken to the end.
            let _next = arena.host(RobotId::first(0).reborn(), plane, 0).unwrap();
            drop((neighbor, arena));
            run.remove_own(owner).unwrap();
        }
    }
}

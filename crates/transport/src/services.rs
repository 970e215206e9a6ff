//! The iceoryx2 side of a run: the one module that touches it.
//!
//! Each life of a robot has two services of its own, one per direction, with its index and incarnation in
//! their names. One uplink for all would cost O(N²), because `receive` scans every connection. The incarnation
//! is in the name because a killed agent's port stays taken: its successor gets services of its own. One
//! reader and one writer at most keep a second agent from driving the same robot.
//!
//! There are two planes, which agree to the last bit: `blackboard` and `publish_subscribe`.

mod blackboard;
mod publish_subscribe;

use std::{collections::BTreeSet, fmt, fs, path::Path, time::Duration};

use iceoryx2::{
    config::Config,
    node::{Node, NodeBuilder, NodeState},
    prelude::{
        CallbackProgression, FileName, LogLevel, Path as IoxPath, SemanticString, ServiceName,
        SignalHandlingMode, ipc, set_log_level,
    },
    service::port_factory::PortFactory,
};

use crate::{
    frame_cache::Frames,
    raw::{Beside, CommandError, PerceptError, RawCommand, RawDelivery, RawLongDelivery},
    run_dir::RunDir,
    shared_memory::explained,
};
use protocol::{
    command::Answer,
    notes::NOTES_MAX,
    payload::SHORT_PAYLOAD_BYTES,
    percept::{Percept, Tick},
    robot_id::RobotId,
    setup::Plane,
};

/// The arena, the agent, and one more that tries to take the robot over and is told no.
const NODES_PER_SERVICE: usize = 3;
/// How long opening a service waits for its creator, who on a busy machine may be slow.
const CREATION_TIMEOUT: Duration = Duration::from_secs(20);

/// A failure of the transport, with what was being done.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ServiceError {
    /// Another agent drives this robot, or has driven it and not been replaced.
    #[error("{0} already has an agent")]
    Taken(RobotId),
    /// The arena does not know this robot, or this life of it.
    #[error("the run has no place for {0}")]
    Unknown(RobotId),
    /// Everything else.
    #[error("cannot {doing}: {reason}")]
    Transport {
        /// Operation that failed.
        doing: String,
        /// Reason that iceoryx2 gave.
        reason: String,
    },
}

fn failed(doing: impl Into<String>) -> impl FnOnce(&dyn fmt::Debug) -> ServiceError {
    let doing = doing.into();
    // iceoryx2 tells of a full file system as of corruption.
    move |reason| ServiceError::Transport { doing, reason: explained(format_args!("{reason:?}")) }
}

/// Why a service of `robot`, or a port of one, could not be opened, by the name of iceoryx2's error.
fn not_opened(robot: RobotId, reason: &dyn fmt::Debug) -> ServiceError {
    match format!("{reason:?}").as_str() {
        "DoesNotExist" => ServiceError::Unknown(robot),
        // Too many nodes, or readers, writers, subscribers, publishers.
        name if name.starts_with("ExceedsMax") => ServiceError::Taken(robot),
        _ => failed(format!("open the services of {robot}"))(reason),
    }
}

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
    /// What came with the command that was received last.
    beside: Beside,
    notes_len: usize,
}

#[derive(Debug)]
#[expect(clippy::large_enum_variant, reason = "in lock-step all robots have the largest")]
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
        Ok(ArenaPorts { ends, payload_bytes_max, beside: Beside::default(), notes_len: 0 })
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

/// The name of a service of one life of a robot.
fn service_name(what: &str, robot: RobotId) -> ServiceName {
    let name = format!("{what}/{}/{}", robot.index, robot.incarnation);
    ServiceName::new(&name).expect("a short path of letters and digits is a service name")
}

impl ArenaPorts {
    /// Sends one tick's percept, with the frames of its packets from `frames`.
    pub fn send(&mut self, percept: &Percept, frames: &mut Frames) -> Result<(), ServiceError> {
        match &mut self.ends {
            ArenaEnds::Blackboard(ports) => {
                ports.send(percept, frames);
                Ok(())
            }
            ArenaEnds::Queues(ports) => ports.send(percept, frames),
            ArenaEnds::LongQueues(ports) => ports.send(percept, frames),
        }
    }

    /// The next unread command, as it came.
    pub fn receive(&mut self) -> Result<Option<RawCommand>, ServiceError> {
        let beside = &mut self.beside;
        let received = match &mut self.ends {
            ArenaEnds::Blackboard(ports) => ports.receive(beside),
            ArenaEnds::Queues(ports) => ports.receive(beside)?,
            ArenaEnds::LongQueues(ports) => ports.receive(beside)?,
        };
        self.notes_len = received.map_or(0, |command| usize::from(command.notes_len).min(NOTES_MAX));
        Ok(received)
    }

    /// The notes that came with the command that was received last.
    pub fn notes(&self) -> &[f64] {
        &self.beside.notes[..self.notes_len]
    }

    /// Checks the command that was received last: whether it is of life `expected`, and answers `tick`. The frame of its
    /// packet goes to `frames`, for those who will hear it.
    pub fn check(
        &self,
        command: &RawCommand,
        expected: RobotId,
        tick: Tick,
        frames: &mut Frames,
    ) -> Result<Answer, CommandError> {
        let answer = command.check(&self.beside.frame.0, self.payload_bytes_max, expected, tick)?;
        frames.keep(&answer.packet(), command.frame.whole(&self.beside.frame.0)?);
        Ok(answer)
    }

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

/// Nodes among the users of `service` whose processes have died, as the names of files have them.
fn dead_nodes(service: &impl PortFactory<Service = ipc::Service>) -> BTreeSet<String> {
    let mut dead = BTreeSet::new();
    // What cannot be listed is a few small files, which go with the run.
    let _ = service.nodes(|node| {
        if let NodeState::Dead(_) = node {
            dead.insert(node.node_id().value().to_string());
        }
        CallbackProgression::Continue
    });
    dead
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

impl AgentPorts {
    /// Writes the next unread percept to `percept`; returns how many of its deliveries did not decode, or
    /// why the percept is refused. `None` if there is no unread one.
    pub fn receive(
        &mut self,
        percept: &mut Percept,
    ) -> Result<Option<Result<u32, PerceptError>>, ServiceError> {
        match &mut self.0 {
            AgentEnds::Blackboard(ports) => Ok(ports.receive(percept)),
            AgentEnds::Queues(ports) => ports.receive(percept),
            AgentEnds::LongQueues(ports) => ports.receive(percept),
        }
    }

    /// Sends a command, whose packet is in `frame`, with up to [`NOTES_MAX`] notes.
    pub fn send(&mut self, mut command: RawCommand, frame: &[u8], notes: &[f64]) -> Result<(), ServiceError> {
        command.notes_len = notes.len() as u16;
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
    use protocol::{
        command::Command,
        frame::BodyVector,
        packet::PacketView,
        payload::{PAYLOAD_BYTES_MAX, Payload},
        percept::{DELIVERIES_MAX, Delivery, FieldComponent, Wall},
        units::{Meters, Radians},
    };

    fn run(what: &str) -> (RunDir, crate::run_dir::RunLock) {
        let name = format!("test-services-{what}-{}", std::process::id());
        RunDir::create(name.parse().unwrap()).unwrap()
    }

    const PLANES: [Plane; 2] = [Plane::Blackboard, Plane::PublishSubscribe];

    /// Payloads that a scenario may allow: short and long ones.
    const LIMITS: [usize; 2] = [SHORT_PAYLOAD_BYTES, PAYLOAD_BYTES_MAX];
    /// Lengths of payloads, in bytes.
    const LENGTHS: [usize; 5] = [4, 0, 9, 10, 128];

    fn payload(at: usize, limit: usize) -> Payload {
        let bytes = [at as u8; PAYLOAD_BYTES_MAX];
        Payload::try_from(&bytes[..LENGTHS[at % LENGTHS.len()].min(limit)]).unwrap()
    }

    fn answer(sequence: u32, limit: usize) -> Answer {
        let command = Command {
            estimated_error: Some(BodyVector::new(1.0, 2.0)),
            velocity: BodyVector::HERE,
            payload: payload(sequence as usize, limit),
        };
        Answer { sender: RobotId::first(0), sequence, command }
    }

    /// Sends it with as many notes as its number says, up to all there may be.
    fn send(agent: &mut AgentPorts, tick: Tick, answer: &Answer) {
        let frame = answer.packet().encode();
        agent.send(RawCommand::new(tick, answer, &frame, 1), &frame, &notes(answer.sequence)).unwrap();
    }

    fn notes(sequence: u32) -> Vec<f64> {
        let count = [3, 0, 16, 1][sequence as usize % 4];
        (0..count).map(|at| f64::from(sequence + at) - 0.5).collect()
    }

    /// One with so much of everything, and payloads up to `limit`.
    fn percept(tick: u64, limit: usize, [deliveries, walls, field]: [usize; 3]) -> Percept {
        let mut percept = Percept::empty(tick);
        percept.light.value = tick as f64;
        let length = |at: usize| Meters::new(at as f64).unwrap();
        let bearing = Radians::new(0.5).unwrap();
        for at in 0..deliveries {
            let payload = payload(at + tick as usize, limit);
            let sender = RobotId::first(at as u32);
            let packet = percept.packet(&PacketView { sender, sequence: tick as u32, payload: &payload });
            percept.deliveries.push(Delivery { packet, range: length(at), bearing, orientation: bearing });
        }
        percept.walls = (0..walls).map(|at| Wall { distance: length(at), bearing }).collect();
        percept.field = (0..field).map(|at| FieldComponent::Constant(at as f64)).collect();
        percept
    }

    /// Every plane with every limit.
    fn cases() -> impl Iterator<Item = (Plane, usize)> {
        PLANES.into_iter().flat_map(|plane| LIMITS.map(|limit| (plane, limit)))
    }

    /// Conformance of both planes: what passes this can carry any run.
    #[test]
    fn percepts_go_down_and_commands_come_up_on_either_plane() {
        for (plane, limit) in cases() {
            let (run, owner) = run("roundtrip");
            let robot = RobotId::first(0);
            let arena = Session::enter(&run).unwrap();
            let mut host = arena.host(robot, plane, limit).unwrap();
            let mut agent = Session::enter(&run).unwrap().join(robot, plane, limit).unwrap();
            let (mut read, mut frames) = (Percept::empty(0), Frames::of(DELIVERIES_MAX));
            assert_eq!(agent.receive(&mut read), Ok(None), "{plane:?}");
            assert_eq!(host.receive(), Ok(None), "{plane:?}");
            let sizes = [[0, 0, 0], [1, 4, 0], [8, 0, 3], [9, 8, 16], [256, 1, 1], [7, 0, 0], [0, 2, 0]];
            for (tick, sizes) in (0..).zip(sizes) {
                let sent = percept(tick, limit, sizes);
                host.send(&sent, &mut frames).unwrap();
                assert_eq!(agent.receive(&mut read), Ok(Some(Ok(0))), "{plane:?}, tick {tick}");
                assert_eq!(read, sent, "{plane:?}");
                assert_eq!(agent.receive(&mut read), Ok(None), "{plane:?}: it is read once");

                let answer = answer(tick as u32, limit);
                send(&mut agent, tick, &answer);
                let command = host.receive().unwrap().unwrap();
                assert_eq!(host.check(&command, robot, tick, &mut frames), Ok(answer), "{plane:?}");
                assert_eq!(host.notes(), notes(tick as u32), "{plane:?}");
                assert_eq!(host.receive(), Ok(None), "{plane:?}: it is read once");
            }
            drop((host, agent, arena));
            run.remove_own(owner).unwrap();
        }
    }

    #[test]
    fn a_payload_beyond_the_limit_is_refused_by_its_length_and_the_next_command_is_read() {
        for (plane, limit) in PLANES.into_iter().flat_map(|plane| [0, 4, 9, 100].map(|limit| (plane, limit)))
        {
            let (run, owner) = run("limit");
            let robot = RobotId::first(0);
            let arena = Session::enter(&run).unwrap();
            let mut host = arena.host(robot, plane, limit).unwrap();
            let mut agent = Session::enter(&run).unwrap().join(robot, plane, limit).unwrap();
            let mut frames = Frames::of(1);
            for (length, refused) in [(limit + 1, true), (128, true), (limit, false)] {
                let mut answer = answer(length as u32, limit);
                answer.command.payload = Payload::try_from(&[1; 128][..length]).unwrap();
                send(&mut agent, 0, &answer);
                let command = host.receive().unwrap().unwrap();
                let expected = if refused {
                    Err(CommandError::Payload(protocol::payload::PayloadOverLimit { length, limit }))
                } else {
                    Ok(answer)
                };
                assert_eq!(host.check(&command, robot, 0, &mut frames), expected, "{plane:?} {limit}");
            }
            drop((host, agent, arena));
            run.remove_own(owner).unwrap();
        }
    }

    /// A new trial sends the same tick once more.
    #[test]
    fn the_same_message_again_is_a_new_one() {
        for (plane, limit) in cases() {
            let (run, owner) = run("again");
            let robot = RobotId::first(0);
            let arena = Session::enter(&run).unwrap();
            let mut host = arena.host(robot, plane, limit).unwrap();
            let mut agent = Session::enter(&run).unwrap().join(robot, plane, limit).unwrap();
            let (mut read, mut frames) = (Percept::empty(0), Frames::of(1));
            for _ in 0..2 {
                host.send(&percept(3, limit, [1, 1, 0]), &mut frames).unwrap();
                assert_eq!(agent.receive(&mut read), Ok(Some(Ok(0))), "{plane:?}");
                send(&mut agent, 3, &answer(4, limit));
                assert!(host.receive().unwrap().is_some(), "{plane:?}");
            }
            drop((host, agent, arena));
            run.remove_own(owner).unwrap();
        }
    }

    /// A percept that is read while another thread writes as fast as it can is whole, and newer than the last.
    #[test]
    fn a_percept_that_is_replaced_while_it_is_read_is_never_a_mixture() {
        for (plane, limit) in cases() {
            let (run, owner) = run("mixture");
            let robot = RobotId::first(0);
            let arena = Session::enter(&run).unwrap();
            let mut host = arena.host(robot, plane, limit).unwrap();
            std::thread::scope(|scope| {
                let reader = scope.spawn(|| {
                    let mut agent = Session::enter(&run).unwrap().join(robot, plane, limit).unwrap();
                    let (mut read, mut newest) = (Percept::empty(0), 0);
                    for _ in 0..200 {
                        while agent.receive(&mut read).unwrap() != Some(Ok(0)) {}
                        assert!(read.tick > newest, "{plane:?}: {} after {newest}", read.tick);
                        newest = read.tick;
                        assert_eq!(read, percept(newest, limit, [20, 3, 2]), "{plane:?}");
                    }
                });
                let (mut frames, mut tick) = (Frames::of(32), 0);
                while !reader.is_finished() {
                    tick += 1;
                    host.send(&percept(tick, limit, [20, 3, 2]), &mut frames).unwrap();
                }
                reader.join().unwrap();
            });
            drop((host, arena));
            run.remove_own(owner).unwrap();
        }
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
        send(&mut agent, 0, &answer(0, 0));
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

    #[test]
    fn a_second_agent_is_told_that_the_robot_is_taken() {
        for plane in PLANES {
            let (run, owner) = run("taken");
            let robot = RobotId::first(0);
            let arena = Session::enter(&run).unwrap();
            let _host = arena.host(robot, plane, 0).unwrap();
            let first = Session::enter(&run).unwrap();
            let _agent = first.join(robot, plane, 0).unwrap();
            let second = Session::enter(&run).unwrap();
            assert_eq!(second.join(robot, plane, 0).unwrap_err(), ServiceError::Taken(robot), "{plane:?}");
            run.remove_own(owner).unwrap();
        }
    }

    #[test]
    fn an_agent_for_an_unknown_robot_is_told_so() {
        for plane in PLANES {
            let (run, owner) = run("unknown");
            let medium = Session::enter(&run).unwrap();
            let robot = RobotId::first(50);
            assert_eq!(medium.join(robot, plane, 0).unwrap_err(), ServiceError::Unknown(robot), "{plane:?}");
            run.remove_own(owner).unwrap();
        }
    }
}

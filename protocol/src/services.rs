//! The iceoryx2 side of a run: the one module that touches it.
//!
//! Each life of a robot has two publish-subscribe services of its own:
//!
//! ```text
//! inbox/<robot>/<incarnation>    arena -> agent   slice of RawDelivery, header RawPercept
//! uplink/<robot>/<incarnation>   agent -> arena   RawCommand
//! ```
//!
//! One uplink for all would cost O(N²), because `receive` scans every connection. The incarnation
//! is in the name because a killed agent's port stays taken: its successor gets a service of its
//! own. `max_subscribers(1)` keeps a second agent from driving the same robot.

use core::{fmt, time::Duration};
use std::{
    collections::BTreeSet,
    format, fs,
    path::Path,
    string::{String, ToString},
    vec::Vec,
};

use iceoryx2::{
    config::Config,
    node::{Node, NodeBuilder, NodeState},
    port::{publisher::Publisher, subscriber::Subscriber},
    prelude::{
        AllocationStrategy, CallbackProgression, FileName, IceoryxSend, LogLevel, Path as IoxPath,
        SemanticString, ServiceName, SignalHandlingMode, ZeroCopySend, ipc, set_log_level,
    },
    service::{
        builder::publish_subscribe::Builder,
        port_factory::{PortFactory as _, publish_subscribe::PortFactory},
    },
};

use crate::{
    percept::{DELIVERIES_MAX, Percept},
    raw::{RawCommand, RawDelivery, RawPercept},
    robot_id::RobotId,
    run_dir::RunDir,
};

/// Messages that wait unread, and that a reader may hold: in lock-step one of each is in flight,
/// in real time the newest replaces the oldest.
const BUFFERED: usize = 2;
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
        /// What was being done.
        doing: String,
        /// What iceoryx2 said.
        reason: String,
    },
}

fn failed(doing: impl Into<String>) -> impl FnOnce(&dyn fmt::Debug) -> ServiceError {
    let doing = doing.into();
    move |reason| ServiceError::Transport { doing, reason: format!("{reason:?}") }
}

/// One process's access to the services of one run.
#[derive(Debug)]
pub struct Medium {
    node: Node<ipc::Service>,
}

/// The arena's ends of one robot's services.
#[derive(Debug)]
pub struct ArenaPorts {
    inbox: Publisher<ipc::Service, [RawDelivery], RawPercept>,
    uplink: Subscriber<ipc::Service, RawCommand, ()>,
    // The services exist as long as somebody holds them; the arena opens them before the agent comes.
    services: Services,
}

/// An agent's ends of its services.
#[derive(Debug)]
pub struct AgentPorts {
    inbox: Subscriber<ipc::Service, [RawDelivery], RawPercept>,
    uplink: Publisher<ipc::Service, RawCommand, ()>,
}

#[derive(Debug)]
struct Services {
    inbox: PortFactory<ipc::Service, [RawDelivery], RawPercept>,
    uplink: PortFactory<ipc::Service, RawCommand, ()>,
}

impl Medium {
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

    /// The arena makes the services of one life of a robot. An inbox has room for as many
    /// deliveries as a percept may hold, however few robots there are: copies and late packets
    /// come on top. Shared memory is taken only where it is touched.
    pub fn host(&self, robot: RobotId) -> Result<ArenaPorts, ServiceError> {
        let services = self.services(robot, true)?;
        let inbox = services
            .inbox
            .publisher_builder()
            .initial_max_slice_len(DELIVERIES_MAX)
            .allocation_strategy(AllocationStrategy::Static)
            .max_loaned_samples(1)
            .create()
            .map_err(|error| failed(format!("open the inbox of {robot}"))(&error))?;
        let uplink = services
            .uplink
            .subscriber_builder()
            .create()
            .map_err(|error| failed(format!("open the uplink of {robot}"))(&error))?;
        Ok(ArenaPorts { inbox, uplink, services })
    }

    /// An agent takes its place as `robot`.
    pub fn join(&self, robot: RobotId) -> Result<AgentPorts, ServiceError> {
        let services = self.services(robot, false)?;
        let taken = |_| ServiceError::Taken(robot);
        let inbox = services.inbox.subscriber_builder().create().map_err(taken)?;
        let uplink = services
            .uplink
            .publisher_builder()
            .max_loaned_samples(1)
            .create()
            .map_err(|_| ServiceError::Taken(robot))?;
        Ok(AgentPorts { inbox, uplink })
    }

    fn services(&self, robot: RobotId, create: bool) -> Result<Services, ServiceError> {
        let name = |what: &str| {
            let name = format!("{what}/{}/{}", robot.index, robot.incarnation);
            ServiceName::new(&name).expect("a short path of letters and digits is a service name")
        };
        let builder = |what: &str| self.node.service_builder(&name(what));
        let inbox =
            one_to_one(builder("inbox").publish_subscribe::<[RawDelivery]>().user_header::<RawPercept>());
        let uplink = one_to_one(builder("uplink").publish_subscribe::<RawCommand>());
        if create {
            let doing = || failed(format!("create the services of {robot}"));
            Ok(Services {
                inbox: inbox.create().map_err(|error| doing()(&error))?,
                uplink: uplink.create().map_err(|error| doing()(&error))?,
            })
        } else {
            let refused = |reason: String| match reason.as_str() {
                "DoesNotExist" => ServiceError::Unknown(robot),
                "ExceedsMaxNumberOfNodes" => ServiceError::Taken(robot),
                _ => ServiceError::Transport { doing: format!("open the services of {robot}"), reason },
            };
            Ok(Services {
                inbox: inbox.open().map_err(|error| refused(format!("{error:?}")))?,
                uplink: uplink.open().map_err(|error| refused(format!("{error:?}")))?,
            })
        }
    }
}

impl ArenaPorts {
    /// Sends one tick's percept. Returns false if no agent is there to get it.
    pub fn send(&self, percept: &Percept) -> Result<bool, ServiceError> {
        let doing = || failed(format!("send tick {}", percept.tick));
        let mut sample =
            self.inbox.loan_slice_uninit(percept.deliveries.len()).map_err(|error| doing()(&error))?;
        *sample.user_header_mut() = RawPercept::new(percept);
        let sample = sample.write_from_fn(|at| RawDelivery::new(&percept.deliveries[at]));
        sample.send().map(|receivers| receivers > 0).map_err(|error| doing()(&error))
    }

    /// The next unread command, as it came.
    pub fn receive(&self) -> Result<Option<RawCommand>, ServiceError> {
        let sample = self.uplink.receive().map_err(|error| failed("receive a command")(&error))?;
        Ok(sample.map(|sample| *sample.payload()))
    }

    /// Identifiers that the names of files carry which a killed agent has left; none if there was
    /// no agent, if it has left in order, or if it lives.
    fn marks(&self) -> BTreeSet<String> {
        let Services { inbox, uplink } = &self.services;
        let (mut marks, go_on) = (BTreeSet::new(), CallbackProgression::Continue);
        // What cannot be listed is a few small files, which go with the run.
        let _ = inbox.nodes(|node| {
            if let NodeState::Dead(_) = node {
                marks.insert(node.node_id().value().to_string());
            }
            go_on
        });
        if !marks.is_empty() {
            let mut mark = |value: u128| {
                marks.insert(value.to_string());
                go_on
            };
            inbox.dynamic_config().list_subscribers(|port| mark(port.subscriber_id.value()));
            uplink.dynamic_config().list_publishers(|port| mark(port.publisher_id.value()));
            mark(inbox.unique_service_id().value());
            mark(uplink.unique_service_id().value());
            marks.extend([inbox.service_hash(), uplink.service_hash()].map(ToString::to_string));
        }
        marks
    }
}

/// Lets go of `lives` that are over, and removes what their processes have left if they were
/// killed: nodes, data, ends of connections, and services that count the dead among their users.
/// What a process that still lives holds is not touched.
///
/// iceoryx2 removes a dead node too, but searches all files of a run several times for it: 3.8 ms at
/// 100 robots, and that grows with them. This goes through the files once for all `lives`: 1.2 ms
/// for one, 40 ms for all 100 at once.
pub fn bury(run: &RunDir, lives: Vec<ArenaPorts>) {
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
    /// Hands the next unread percept to `read`, in place. Returns `None` if there is none.
    pub fn receive<T>(
        &self,
        read: impl FnOnce(&RawPercept, &[RawDelivery]) -> T,
    ) -> Result<Option<T>, ServiceError> {
        let sample = self.inbox.receive().map_err(|error| failed("receive a percept")(&error))?;
        Ok(sample.map(|sample| read(sample.user_header(), sample.payload())))
    }

    /// Sends a command.
    pub fn send(&self, command: RawCommand) -> Result<(), ServiceError> {
        let sent = self.uplink.send_copy(command).map_err(|error| failed("send a command")(&error))?;
        match sent {
            0 => Err(ServiceError::Transport {
                doing: "send a command".to_string(),
                reason: "the arena does not listen".to_string(),
            }),
            _ => Ok(()),
        }
    }
}

/// One writer, one reader, and few messages between them.
fn one_to_one<P, H>(builder: Builder<P, H, ipc::Service>) -> Builder<P, H, ipc::Service>
where
    P: fmt::Debug + IceoryxSend + ?Sized,
    H: fmt::Debug + ZeroCopySend,
{
    builder
        .max_publishers(1)
        .max_subscribers(1)
        .max_nodes(NODES_PER_SERVICE)
        .subscriber_max_buffer_size(BUFFERED)
        .subscriber_max_borrowed_samples(BUFFERED)
        .history_size(0)
        .enable_safe_overflow(true)
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
    config.defaults.publish_subscribe.subscriber_expired_connection_buffer = BUFFERED;
    Ok(config)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{command::Command, frame::BodyVector, packet::Packet};

    fn run(what: &str) -> (RunDir, crate::run_dir::RunLock) {
        let name = format!("test-services-{what}-{}", std::process::id());
        RunDir::create(name.parse().unwrap()).unwrap()
    }

    #[test]
    fn percepts_go_down_and_commands_come_up() {
        let (run, owner) = run("roundtrip");
        let robot = RobotId { index: 3, incarnation: 1 };
        let arena = Medium::enter(&run).unwrap();
        let host = arena.host(robot).unwrap();
        let agent = Medium::enter(&run).unwrap().join(robot).unwrap();

        let mut sent = Percept::empty(5);
        sent.light.value = 2.5;
        assert!(host.send(&sent).unwrap());
        let mut read = Percept::empty(0);
        let refused = agent.receive(|header, deliveries| header.read(deliveries, &mut read)).unwrap();
        assert_eq!((refused, &read), (Some(Ok(0)), &sent));

        let command = Command {
            goal: BodyVector::new(1.0, 2.0),
            velocity: BodyVector::HERE,
            packet: Packet { sender: robot, sequence: 0, light: 0.0 },
        };
        agent.send(RawCommand::new(5, &command, 1)).unwrap();
        assert_eq!(host.receive().unwrap().unwrap().check(robot, 5), Ok(command));
        assert_eq!(host.receive().unwrap(), None);
        drop((host, agent, arena));
        run.remove_own(owner).unwrap();
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
        let run = RunDir::of(name.parse().unwrap());
        let agent = Medium::enter(&run).unwrap().join(RobotId::first(0)).unwrap();
        let command = Command {
            goal: BodyVector::HERE,
            velocity: BodyVector::HERE,
            packet: Packet { sender: RobotId::first(0), sequence: 0, light: 0.0 },
        };
        agent.send(RawCommand::new(0, &command, 1)).unwrap();
        std::thread::sleep(Duration::from_secs(60));
    }

    #[test]
    fn nothing_is_left_of_a_life_that_was_killed() {
        let (run, owner) = run("killed");
        let arena = Medium::enter(&run).unwrap();
        let neighbor = arena.host(RobotId::first(1)).unwrap();
        let before = files(&run);
        let ports = arena.host(RobotId::first(0)).unwrap();
        let mut agent = std::process::Command::new(std::env::current_exe().unwrap())
            .args(["--ignored", "--exact", "services::tests::an_agent_that_waits_to_be_killed"])
            .env("LAMPLIGHT_TEST_RUN", run.name().to_string())
            .stdout(std::process::Stdio::null())
            .spawn()
            .unwrap();
        while ports.receive().unwrap().is_none() {
            assert_eq!(agent.try_wait().unwrap(), None, "the agent ended by itself");
            ports.send(&Percept::empty(0)).unwrap();
            std::thread::sleep(Duration::from_millis(1));
        }
        agent.kill().unwrap();
        agent.wait().unwrap();
        assert!(files(&run).len() > before.len() + 10, "it has left something");
        bury(&run, Vec::new());
        assert!(files(&run).len() > before.len() + 10, "its life is not said to be over yet");
        bury(&run, std::vec![ports]);
        assert_eq!(files(&run), before);
        drop((neighbor, arena));
        run.remove_own(owner).unwrap();
    }

    #[test]
    fn a_second_agent_is_told_that_the_robot_is_taken() {
        let (run, owner) = run("taken");
        let robot = RobotId::first(0);
        let arena = Medium::enter(&run).unwrap();
        let _host = arena.host(robot).unwrap();
        let first = Medium::enter(&run).unwrap();
        let _agent = first.join(robot).unwrap();
        let second = Medium::enter(&run).unwrap();
        assert_eq!(second.join(robot).unwrap_err(), ServiceError::Taken(robot));
        run.remove_own(owner).unwrap();
    }

    #[test]
    fn an_agent_for_an_unknown_robot_is_told_so() {
        let (run, owner) = run("unknown");
        let medium = Medium::enter(&run).unwrap();
        let robot = RobotId::first(50);
        assert_eq!(medium.join(robot).unwrap_err(), ServiceError::Unknown(robot));
        run.remove_own(owner).unwrap();
    }
}

//! The part of iceoryx2 that both planes use alike: names of services, their errors and their dead users.

use std::{collections::BTreeSet, fmt};

use iceoryx2::{
    node::NodeState,
    prelude::{CallbackProgression, ServiceName, ipc},
    service::port_factory::PortFactory,
};

use crate::{ends::ServiceError, shared_memory::explained};
use protocol::robot_id::RobotId;

/// The arena, the agent, and one more that tries to take the robot over and is told no.
pub(super) const NODES_PER_SERVICE: usize = 3;

pub(super) fn failed(doing: impl Into<String>) -> impl FnOnce(&dyn fmt::Debug) -> ServiceError {
    let doing = doing.into();
    // iceoryx2 tells of a full file system as of corruption.
    move |reason| ServiceError::Transport { doing, reason: explained(format_args!("{reason:?}")) }
}

/// Why a service of `robot`, or a port of one, could not be opened, by the name of iceoryx2's error.
pub(super) fn not_opened(robot: RobotId, reason: &dyn fmt::Debug) -> ServiceError {
    match format!("{reason:?}").as_str() {
        "DoesNotExist" => ServiceError::Unknown(robot),
        // Too many nodes, or readers, writers, subscribers, publishers.
        name if name.starts_with("ExceedsMax") => ServiceError::Taken(robot),
        _ => failed(format!("open the services of {robot}"))(reason),
    }
}

/// The name of a service of one life of a robot.
pub(super) fn service_name(what: &str, robot: RobotId) -> ServiceName {
    let name = format!("{what}/{}/{}", robot.index, robot.incarnation);
    ServiceName::new(&name).expect("a short path of letters and digits is a service name")
}

/// Nodes among the users of `service` whose processes have died, as the names of files have them.
pub(super) fn dead_nodes(service: &impl PortFactory<Service = ipc::Service>) -> BTreeSet<String> {
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

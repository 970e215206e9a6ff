//! Queues, for real time: what has not been read waits, and the newest replaces the oldest.
//!
//! ```text
//! inbox/<robot>/<incarnation>    arena -> agent   slice of RawDelivery, header RawPercept
//! uplink/<robot>/<incarnation>   agent -> arena   RawCommand
//! ```

use std::{collections::BTreeSet, fmt};

use iceoryx2::{
    node::Node,
    port::{publisher::Publisher, subscriber::Subscriber},
    prelude::{AllocationStrategy, CallbackProgression, IceoryxSend, ZeroCopySend, ipc},
    service::{
        builder::publish_subscribe::Builder,
        port_factory::{PortFactory as _, publish_subscribe::PortFactory},
    },
};

use super::{NODES_PER_SERVICE, ServiceError, dead_nodes, failed, not_opened, service_name};
use crate::{
    frame_cache::Frames,
    raw::{PerceptError, RawCommand, RawDelivery, RawPercept},
};
use protocol::{
    percept::{DELIVERIES_MAX, Percept},
    robot_id::RobotId,
};

/// Messages that wait unread, and that a reader may hold: in lock-step one of each is in flight,
/// in real time the newest replaces the oldest.
pub(super) const BUFFERED: usize = 2;

/// The arena's ends.
#[derive(Debug)]
pub(super) struct ArenaPorts {
    inbox: Publisher<ipc::Service, [RawDelivery], RawPercept>,
    uplink: Subscriber<ipc::Service, RawCommand, ()>,
    // The services exist as long as somebody holds them; the arena opens them before the agent comes.
    services: Services,
}

/// An agent's ends.
#[derive(Debug)]
pub(super) struct AgentPorts {
    inbox: Subscriber<ipc::Service, [RawDelivery], RawPercept>,
    uplink: Publisher<ipc::Service, RawCommand, ()>,
}

#[derive(Debug)]
struct Services {
    inbox: PortFactory<ipc::Service, [RawDelivery], RawPercept>,
    uplink: PortFactory<ipc::Service, RawCommand, ()>,
}

impl ArenaPorts {
    pub(super) fn host(node: &Node<ipc::Service>, robot: RobotId) -> Result<Self, ServiceError> {
        let doing = || failed(format!("create the services of {robot}"));
        let (inbox, uplink) = builders(node, robot);
        let services = Services {
            inbox: inbox.create().map_err(|error| doing()(&error))?,
            uplink: uplink.create().map_err(|error| doing()(&error))?,
        };
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
        Ok(Self { inbox, uplink, services })
    }

    pub(super) fn send(&self, percept: &Percept, frames: &mut Frames) -> Result<(), ServiceError> {
        let doing = || failed(format!("send tick {}", percept.tick));
        let mut sample =
            self.inbox.loan_slice_uninit(percept.deliveries.len()).map_err(|error| doing()(&error))?;
        *sample.user_header_mut() = RawPercept::new(percept);
        let sample = sample.write_from_fn(|at| {
            let delivery = &percept.deliveries[at];
            RawDelivery::new(delivery, frames.get(&delivery.packet))
        });
        sample.send().map(drop).map_err(|error| doing()(&error))
    }

    pub(super) fn receive(&self) -> Result<Option<RawCommand>, ServiceError> {
        let sample = self.uplink.receive().map_err(|error| failed("receive a command")(&error))?;
        Ok(sample.map(|sample| *sample.payload()))
    }

    pub(super) fn dead_nodes(&self) -> BTreeSet<String> {
        dead_nodes(&self.services.inbox)
    }

    pub(super) fn marks(&self) -> BTreeSet<String> {
        let Services { inbox, uplink } = &self.services;
        let mut marks = self.dead_nodes();
        if !marks.is_empty() {
            let mut mark = |value: u128| {
                marks.insert(value.to_string());
                CallbackProgression::Continue
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

impl AgentPorts {
    pub(super) fn join(node: &Node<ipc::Service>, robot: RobotId) -> Result<Self, ServiceError> {
        let (inbox, uplink) = builders(node, robot);
        let services = Services {
            inbox: inbox.open().map_err(|error| not_opened(robot, &error))?,
            uplink: uplink.open().map_err(|error| not_opened(robot, &error))?,
        };
        let inbox =
            services.inbox.subscriber_builder().create().map_err(|error| not_opened(robot, &error))?;
        let uplink = services
            .uplink
            .publisher_builder()
            .max_loaned_samples(1)
            .create()
            .map_err(|error| not_opened(robot, &error))?;
        Ok(Self { inbox, uplink })
    }

    pub(super) fn receive(
        &self,
        percept: &mut Percept,
    ) -> Result<Option<Result<u32, PerceptError>>, ServiceError> {
        let sample = self.inbox.receive().map_err(|error| failed("receive a percept")(&error))?;
        Ok(sample.map(|sample| sample.user_header().read(sample.payload(), percept)))
    }

    pub(super) fn send(&self, command: RawCommand) -> Result<(), ServiceError> {
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

type Builders = (Builder<[RawDelivery], RawPercept, ipc::Service>, Builder<RawCommand, (), ipc::Service>);

fn builders(node: &Node<ipc::Service>, robot: RobotId) -> Builders {
    let builder = |what: &str| node.service_builder(&service_name(what, robot));
    (
        one_to_one(builder("inbox").publish_subscribe::<[RawDelivery]>().user_header::<RawPercept>()),
        one_to_one(builder("uplink").publish_subscribe::<RawCommand>()),
    )
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

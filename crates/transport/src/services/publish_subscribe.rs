//! Queues, for real time: what has not been read waits, and the newest replaces the oldest.
//!
//! ```text
//! inbox/<robot>/<incarnation>    arena -> agent   slice of RawDelivery (RawLongDelivery where payloads may be long),
//!                                                 header RawPercept
//! uplink/<robot>/<incarnation>   agent -> arena   bytes of a long frame, then of notes, header RawCommand
//! ```

use std::{collections::BTreeSet, fmt};

use arrayvec::ArrayVec;
use iceoryx2::{
    node::Node,
    port::{publisher::Publisher, subscriber::Subscriber},
    prelude::{AllocationStrategy, CallbackProgression, IceoryxSend, ZeroCopySend, ipc},
    service::{
        builder::publish_subscribe::Builder,
        port_factory::{PortFactory as _, publish_subscribe::PortFactory},
    },
};

use super::common::{NODES_PER_SERVICE, dead_nodes, failed, not_opened, service_name};
use crate::{
    ends::ServiceError,
    frame_cache::{Frames, KeptFrame},
    raw::{
        Beside, PerceptError, RawCommand, RawDelivery, RawLongDelivery, RawLongFrame, RawNotes, RawPercept,
        add_deliveries,
    },
};
use protocol::{
    packet::FRAME_BYTES_MAX,
    percept::{DELIVERIES_MAX, Delivery, Percept},
    robot_id::RobotId,
};

/// Messages that wait unread, and that a reader may hold: in lock-step one of each is in flight,
/// in real time the newest replaces the oldest.
pub(super) const BUFFERED: usize = 2;

/// A delivery in an inbox.
pub(super) trait InInbox: ZeroCopySend + fmt::Debug + 'static {
    /// The message that carries `delivery`, whose packet is in `kept`.
    fn new(delivery: &Delivery, kept: KeptFrame<'_>) -> Self;

    /// The delivery, and the bytes of its frame if that is long.
    fn parts(&self) -> (&RawDelivery, &[u8]);
}

impl InInbox for RawDelivery {
    fn new(delivery: &Delivery, kept: KeptFrame<'_>) -> Self {
        Self::new(delivery, *kept.frame)
    }

    fn parts(&self) -> (&RawDelivery, &[u8]) {
        (self, &[])
    }
}

impl InInbox for RawLongDelivery {
    fn new(delivery: &Delivery, kept: KeptFrame<'_>) -> Self {
        let frame = kept.long.copied().unwrap_or_default();
        Self { delivery: RawDelivery::new(delivery, *kept.frame), frame }
    }

    fn parts(&self) -> (&RawDelivery, &[u8]) {
        (&self.delivery, &self.frame.0)
    }
}

/// Most bytes that go with a command: a long frame, and notes.
const BESIDE_BYTES_MAX: usize = FRAME_BYTES_MAX + size_of::<RawNotes>();

/// The arena's ends.
#[derive(Debug)]
pub(super) struct ArenaPorts<D: InInbox> {
    inbox: Publisher<ipc::Service, [D], RawPercept>,
    uplink: Subscriber<ipc::Service, [u8], RawCommand>,
    /// The command that was received last.
    last: RawCommand,
    // The services exist as long as somebody holds them; the arena opens them before the agent comes.
    services: Services<D>,
}

/// An agent's ends.
#[derive(Debug)]
pub(super) struct AgentPorts<D: InInbox> {
    inbox: Subscriber<ipc::Service, [D], RawPercept>,
    uplink: Publisher<ipc::Service, [u8], RawCommand>,
}

#[derive(Debug)]
struct Services<D: InInbox> {
    inbox: PortFactory<ipc::Service, [D], RawPercept>,
    uplink: PortFactory<ipc::Service, [u8], RawCommand>,
}

impl<D: InInbox> ArenaPorts<D> {
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
        Ok(Self { inbox, uplink, last: RawCommand::default(), services })
    }

    pub(super) fn send(&self, percept: &Percept, frames: &mut Frames) -> Result<(), ServiceError> {
        let doing = || failed(format!("send tick {}", percept.tick));
        let mut sample =
            self.inbox.loan_slice_uninit(percept.deliveries.len()).map_err(|error| doing()(&error))?;
        *sample.user_header_mut() = RawPercept::new(percept);
        let sample = sample.write_from_fn(|at| {
            let delivery = &percept.deliveries[at];
            D::new(delivery, frames.of_delivery(percept, delivery))
        });
        sample.send().map(drop).map_err(|error| doing()(&error))
    }

    /// Returns the next unread command; what does not lie in it is in `beside`.
    pub(super) fn receive(&mut self, beside: &mut Beside) -> Result<Option<&RawCommand>, ServiceError> {
        let sample = self.uplink.receive().map_err(|error| failed("receive a command")(&error))?;
        let Some(sample) = sample else { return Ok(None) };
        self.last = *sample.user_header();
        let (frame, bytes) = (&self.last.frame, sample.payload());
        let frame_len = if frame.is_long() { usize::from(frame.len) } else { 0 };
        let (frame, notes) = bytes.split_at(frame_len.min(bytes.len()).min(FRAME_BYTES_MAX));
        if !frame.is_empty() {
            beside.frame = RawLongFrame::of(frame);
        }
        for (note, bytes) in beside.notes.iter_mut().zip(notes.as_chunks().0) {
            *note = f64::from_le_bytes(*bytes);
        }
        Ok(Some(&self.last))
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

impl<D: InInbox> AgentPorts<D> {
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
            .initial_max_slice_len(BESIDE_BYTES_MAX)
            .allocation_strategy(AllocationStrategy::Static)
            .max_loaned_samples(1)
            .create()
            .map_err(|error| not_opened(robot, &error))?;
        Ok(Self { inbox, uplink })
    }

    // Not inlined, nor is `send`: who waits for a tick on a blackboard need not have its code in the way.
    #[inline(never)]
    pub(super) fn receive(
        &self,
        percept: &mut Percept,
    ) -> Result<Option<Result<u32, PerceptError>>, ServiceError> {
        let sample = self.inbox.receive().map_err(|error| failed("receive a percept")(&error))?;
        Ok(sample.map(|sample| {
            let RawPercept { head, walls, field } = sample.user_header();
            head.read(walls, field, percept)?;
            Ok(add_deliveries(sample.payload().iter().map(D::parts), percept))
        }))
    }

    #[inline(never)]
    pub(super) fn send(&self, command: RawCommand, frame: &[u8], notes: &[f64]) -> Result<(), ServiceError> {
        let doing = || failed("send a command");
        let mut bytes = ArrayVec::<u8, BESIDE_BYTES_MAX>::new();
        bytes.extend(frame.iter().copied().filter(|_| command.frame.is_long()));
        bytes.extend(notes.iter().flat_map(|note| note.to_le_bytes()));
        let mut sample = self.uplink.loan_slice_uninit(bytes.len()).map_err(|error| doing()(&error))?;
        *sample.user_header_mut() = command;
        match sample.write_from_slice(&bytes).send().map_err(|error| doing()(&error))? {
            0 => Err(ServiceError::Transport {
                doing: "send a command".to_string(),
                reason: "the arena does not listen".to_string(),
            }),
            _ => Ok(()),
        }
    }
}

type Builders<D> = (Builder<[D], RawPercept, ipc::Service>, Builder<[u8], RawCommand, ipc::Service>);

fn builders<D: InInbox>(node: &Node<ipc::Service>, robot: RobotId) -> Builders<D> {
    let builder = |what: &str| node.service_builder(&service_name(what, robot));
    (
        one_to_one(builder("inbox").publish_subscribe::<[D]>().user_header::<RawPercept>()),
        one_to_one(builder("uplink").publish_subscribe::<[u8]>().user_header::<RawCommand>()),
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

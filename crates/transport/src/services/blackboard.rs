//! One latest value per direction, for lock-step: what a tick brings is read once, and replaced.
//!
//! ```text
//! bin/<robot>/<incarnation>   arena -> agent   BoardHead, RawWalls, RawField, blocks of deliveries, of long frames
//! up/<robot>/<incarnation>    agent -> arena   RawCommand, a long frame, notes
//! ```
//!
//! A blackboard's values are read and written whole, each by itself. So a percept is spread over several keys,
//! of which only those in use are touched, and the head is written last. Every part carries the number of its
//! percept: a percept whose parts are not of one number is being replaced right now, and is not read. So it is with a
//! command and the number of its packet.
//!
//! A message is new if its value has been written since it was last read, whatever is in it.

use std::{collections::BTreeSet, fmt};

use iceoryx2::{
    node::Node,
    port::{
        reader::{BlackboardValue, EntryHandle, Reader},
        writer::{EntryHandleMut, Writer},
    },
    prelude::{CallbackProgression, ZeroCopySend, ipc},
    service::port_factory::{PortFactory as _, blackboard::PortFactory},
};

use super::common::{NODES_PER_SERVICE, dead_nodes, failed, not_opened, service_name};
use crate::{
    ends::ServiceError,
    frame_cache::Frames,
    raw::{
        Beside, PerceptError, RawCommand, RawDelivery, RawField, RawHead, RawLongFrame, RawNotes, RawWalls,
        add_deliveries, raw_field, raw_walls,
    },
};
use protocol::{
    payload::SHORT_PAYLOAD_BYTES,
    percept::{DELIVERIES_MAX, Delivery, Percept},
    robot_id::RobotId,
};

/// Deliveries that are written and read at once.
const BLOCK: usize = 8;
/// The first is in the head.
const BLOCKS_MAX: usize = DELIVERIES_MAX / BLOCK;
const _: () = assert!(DELIVERIES_MAX.is_multiple_of(BLOCK));
/// How often a value is read again that is written at the same time. Whoever writes without end is read as is.
const READS_MAX: usize = 8;

/// Names of values within a blackboard.
type Key = u64;
const COMMAND: Key = 0;
/// Only where payloads may be long.
const LONG_FRAME: Key = 1;
const NOTES: Key = 2;
const HEAD: Key = 0;
const WALLS: Key = 1;
const FIELD: Key = 2;
/// The first of [`BLOCKS_MAX`]; the first block has none.
const DELIVERIES: Key = 3;
/// The first of [`BLOCKS_MAX`], only where payloads may be long.
const LONG_FRAMES: Key = DELIVERIES + BLOCKS_MAX as Key;

/// Head of a percept, with the deliveries that many percepts have, so that whoever reads one looks in one place.
#[derive(Clone, Copy, Debug, Default, ZeroCopySend)]
#[repr(C)]
struct BoardHead {
    head: RawHead,
    /// Number of this percept, from 1.
    number: u64,
    deliveries_len: u64,
    first: Block,
}

/// A part that not every percept has.
#[derive(Clone, Copy, Debug, Default, ZeroCopySend)]
#[repr(C)]
struct Part<T: ZeroCopySend> {
    /// Number of the percept, or of the command's packet, that it belongs to.
    number: u64,
    value: T,
}

impl<T: ZeroCopySend + Copy> Part<T> {
    /// The value if it belongs to `number`.
    fn of(&self, number: u64) -> Option<T> {
        (self.number == number).then_some(self.value)
    }
}

type Block = [RawDelivery; BLOCK];
/// Frames of a block's deliveries, as far as they are long.
type LongBlock = [RawLongFrame; BLOCK];
const _: () = assert!(size_of::<Part<Block>>() == 8 + BLOCK * 48);

type Board = PortFactory<ipc::Service, Key>;
type Written<T> = EntryHandleMut<ipc::Service, Key, T>;
type Read<T> = EntryHandle<ipc::Service, Key, T>;

/// The arena's ends.
pub(super) struct ArenaPorts {
    head: Written<BoardHead>,
    walls: Written<Part<RawWalls>>,
    field: Written<Part<RawField>>,
    blocks: Vec<Written<Part<Block>>>,
    /// None where payloads are short.
    long_blocks: Vec<Written<Part<LongBlock>>>,
    /// Percepts sent.
    sent: u64,
    command: Latest<RawCommand>,
    long_frame: Option<Read<Part<RawLongFrame>>>,
    notes: Read<Part<RawNotes>>,
    services: Services,
}

/// An agent's ends.
pub(super) struct AgentPorts {
    head: Latest<BoardHead>,
    walls: Read<Part<RawWalls>>,
    field: Read<Part<RawField>>,
    blocks: Vec<Read<Part<Block>>>,
    /// None where payloads are short.
    long_blocks: Vec<Read<Part<LongBlock>>>,
    command: Written<RawCommand>,
    long_frame: Option<Written<Part<RawLongFrame>>>,
    notes: Written<Part<RawNotes>>,
}

// The services exist as long as somebody holds them; the arena opens them before the agent comes.
struct Services {
    bin: Board,
    up: Board,
}

/// A value of which one wants to know whether it is new.
struct Latest<T: Copy + ZeroCopySend + fmt::Debug + 'static> {
    entry: Read<T>,
    seen: BlackboardValue<T>,
}

impl<T: Copy + ZeroCopySend + fmt::Debug + 'static> Latest<T> {
    /// Begins after the present value: what is written from now on is new.
    fn of(entry: Read<T>) -> Self {
        let seen = entry.get();
        Self { entry, seen }
    }

    fn get_new(&mut self) -> Option<&T> {
        if self.entry.is_up_to_date(&self.seen) {
            return None;
        }
        for _ in 0..READS_MAX {
            self.seen = self.entry.get();
            if self.entry.is_up_to_date(&self.seen) {
                break;
            }
        }
        Some(&self.seen)
    }
}

impl ArenaPorts {
    pub(super) fn host(
        node: &Node<ipc::Service>,
        robot: RobotId,
        payload_bytes_max: usize,
    ) -> Result<Self, ServiceError> {
        let doing = || failed(format!("create the services of {robot}"));
        let creator = |what: &str| {
            node.service_builder(&service_name(what, robot))
                .blackboard_creator::<Key>()
                .max_readers(1)
                .max_nodes(NODES_PER_SERVICE)
        };
        let mut bin = creator("bin")
            .add_with_default::<BoardHead>(HEAD)
            .add_with_default::<Part<RawWalls>>(WALLS)
            .add_with_default::<Part<RawField>>(FIELD);
        let mut up =
            creator("up").add_with_default::<RawCommand>(COMMAND).add_with_default::<Part<RawNotes>>(NOTES);
        for key in block_keys(DELIVERIES, 1) {
            bin = bin.add_with_default::<Part<Block>>(key);
        }
        let is_long = payload_bytes_max > SHORT_PAYLOAD_BYTES;
        if is_long {
            for key in block_keys(LONG_FRAMES, 0) {
                bin = bin.add_with_default::<Part<LongBlock>>(key);
            }
            up = up.add_with_default::<Part<RawLongFrame>>(LONG_FRAME);
        }
        let services = Services {
            bin: bin.create().map_err(|error| doing()(&error))?,
            up: up.create().map_err(|error| doing()(&error))?,
        };
        let writer = services.bin.writer_builder().create().map_err(|error| doing()(&error))?;
        let reader = services.up.reader_builder().create().map_err(|error| doing()(&error))?;
        let long_keys = block_keys(LONG_FRAMES, 0).filter(|_| is_long);
        Ok(Self {
            head: written(&writer, HEAD)?,
            walls: written(&writer, WALLS)?,
            field: written(&writer, FIELD)?,
            blocks: block_keys(DELIVERIES, 1).map(|key| written(&writer, key)).collect::<Result<_, _>>()?,
            long_blocks: long_keys.map(|key| written(&writer, key)).collect::<Result<_, _>>()?,
            sent: 0,
            command: Latest::of(read(&reader, COMMAND)?),
            long_frame: is_long.then(|| read(&reader, LONG_FRAME)).transpose()?,
            notes: read(&reader, NOTES)?,
            services,
        })
    }

    pub(super) fn send(&mut self, percept: &Percept, frames: &mut Frames) {
        self.sent += 1;
        let number = self.sent;
        if !percept.walls.is_empty() {
            self.walls.update_with_copy(Part { number, value: raw_walls(percept) });
        }
        if !percept.field.is_empty() {
            self.field.update_with_copy(Part { number, value: raw_field(percept) });
        }
        for (deliveries, block) in percept.deliveries.chunks(BLOCK).zip(&self.long_blocks) {
            if let Some(value) = long_block(percept, deliveries, frames) {
                block.update_with_copy(Part { number, value });
            }
        }
        let (first, more) = percept.deliveries.split_at(percept.deliveries.len().min(BLOCK));
        for (deliveries, block) in more.chunks(BLOCK).zip(&self.blocks) {
            block.update_with_copy(Part { number, value: raw_block(percept, deliveries, frames) });
        }
        let deliveries_len = percept.deliveries.len() as u64;
        let first = raw_block(percept, first, frames);
        self.head.update_with_copy(BoardHead { head: RawHead::new(percept), number, deliveries_len, first });
    }

    /// Returns the next unread command; what does not lie in it is in `beside`.
    pub(super) fn receive(&mut self, beside: &mut Beside) -> Option<&RawCommand> {
        let command = self.command.get_new()?;
        let number: u64 = command.frame.sequence().into();
        if let Some(part) = self.long_frame.as_ref().filter(|_| command.frame.is_long()) {
            beside.frame = part.get().of(number)?;
        }
        if command.notes_len > 0 {
            beside.notes = self.notes.get().of(number)?;
        }
        Some(command)
    }

    pub(super) fn dead_nodes(&self) -> BTreeSet<String> {
        dead_nodes(&self.services.bin)
    }

    pub(super) fn marks(&self) -> BTreeSet<String> {
        let Services { bin, up } = &self.services;
        let mut marks = self.dead_nodes();
        if !marks.is_empty() {
            let mut mark = |value: u128| {
                marks.insert(value.to_string());
                CallbackProgression::Continue
            };
            bin.dynamic_config().list_readers(|port| mark(port.reader_id.value()));
            up.dynamic_config().list_writers(|port| mark(port.writer_id.value()));
            mark(bin.unique_service_id().value());
            mark(up.unique_service_id().value());
            marks.extend([bin.service_hash(), up.service_hash()].map(ToString::to_string));
        }
        marks
    }
}

impl AgentPorts {
    pub(super) fn join(
        node: &Node<ipc::Service>,
        robot: RobotId,
        payload_bytes_max: usize,
    ) -> Result<Self, ServiceError> {
        let open = |what: &str| {
            let opener = node.service_builder(&service_name(what, robot)).blackboard_opener::<Key>();
            opener.open().map_err(|error| not_opened(robot, &error))
        };
        let reader = open("bin")?.reader_builder().create().map_err(|error| not_opened(robot, &error))?;
        let writer = open("up")?.writer_builder().create().map_err(|error| not_opened(robot, &error))?;
        let is_long = payload_bytes_max > SHORT_PAYLOAD_BYTES;
        let long_keys = block_keys(LONG_FRAMES, 0).filter(|_| is_long);
        Ok(Self {
            head: Latest::of(read(&reader, HEAD)?),
            walls: read(&reader, WALLS)?,
            field: read(&reader, FIELD)?,
            blocks: block_keys(DELIVERIES, 1).map(|key| read(&reader, key)).collect::<Result<_, _>>()?,
            long_blocks: long_keys.map(|key| read(&reader, key)).collect::<Result<_, _>>()?,
            command: written(&writer, COMMAND)?,
            long_frame: is_long.then(|| written(&writer, LONG_FRAME)).transpose()?,
            notes: written(&writer, NOTES)?,
        })
    }

    pub(super) fn receive(&mut self, percept: &mut Percept) -> Option<Result<u32, PerceptError>> {
        let head = self.head.get_new()?;
        let walls = (head.head.walls_len > 0).then(|| self.walls.get());
        let field = (head.head.field_len > 0).then(|| self.field.get());
        let walls = walls.as_deref();
        let field = field.as_deref();
        if walls.is_some_and(|part| part.number != head.number)
            || field.is_some_and(|part| part.number != head.number)
        {
            return None;
        }
        let walls = walls.map_or(&[][..], |part| &part.value);
        let field = field.map_or(&[][..], |part| &part.value);
        if let Err(error) = head.head.read(walls, field, percept) {
            return Some(Err(error));
        }
        let all = head.deliveries_len as usize;
        let mut long_blocks = self.long_blocks.iter();
        let mut refused = add_block(&head.first[..all.min(BLOCK)], head.number, long_blocks.next(), percept)?;
        let mut left = all.saturating_sub(BLOCK);
        for block in &self.blocks {
            if left == 0 {
                break;
            }
            let block = block.get();
            if block.number != head.number {
                return None;
            }
            let used = left.min(BLOCK);
            refused += add_block(&block.value[..used], head.number, long_blocks.next(), percept)?;
            left -= used;
        }
        // More than there is room for: nobody honest sends that.
        Some(Ok(refused + left as u32))
    }

    pub(super) fn send(&self, command: RawCommand, frame: &[u8], notes: &[f64]) {
        let number = command.frame.sequence().into();
        if let Some(part) = self.long_frame.as_ref().filter(|_| command.frame.is_long()) {
            part.update_with_copy(Part { number, value: RawLongFrame::of(frame) });
        }
        if command.notes_len > 0 {
            let mut value = RawNotes::default();
            value[..notes.len()].copy_from_slice(notes);
            self.notes.update_with_copy(Part { number, value });
        }
        self.command.update_with_copy(command);
    }
}

/// Keys of all blocks from number `first` on.
fn block_keys(begin: Key, first: usize) -> impl Iterator<Item = Key> {
    (first..BLOCKS_MAX).map(move |block| begin + block as Key)
}

/// At most [`BLOCK`] deliveries, padded with zeros.
fn raw_block(percept: &Percept, deliveries: &[Delivery], frames: &mut Frames) -> Block {
    let mut block = Block::default();
    for (slot, delivery) in block.iter_mut().zip(deliveries) {
        *slot = RawDelivery::new(delivery, *frames.of_delivery(percept, delivery).frame);
    }
    block
}

/// The long frames among those of at most [`BLOCK`] deliveries, padded with zeros; `None` if there are none.
fn long_block(percept: &Percept, deliveries: &[Delivery], frames: &mut Frames) -> Option<LongBlock> {
    let mut block = None;
    for (at, delivery) in deliveries.iter().enumerate() {
        if let Some(long) = frames.of_delivery(percept, delivery).long {
            block.get_or_insert_with(LongBlock::default)[at] = *long;
        }
    }
    block
}

/// Adds a block of percept `number` to `percept`; returns how many of its deliveries do not decode, or `None` if their
/// long frames are those of another percept.
fn add_block(
    block: &[RawDelivery],
    number: u64,
    long: Option<&Read<Part<LongBlock>>>,
    percept: &mut Percept,
) -> Option<u32> {
    let Some(long) = long.filter(|_| block.iter().any(|delivery| delivery.frame.is_long())) else {
        return Some(add_deliveries(block.iter().map(|delivery| (delivery, &[][..])), percept));
    };
    let long = long.get();
    let frames = long.value.iter().map(|frame| &frame.0[..]);
    (long.number == number).then(|| add_deliveries(block.iter().zip(frames), percept))
}

fn written<T: ZeroCopySend + Copy>(
    writer: &Writer<ipc::Service, Key>,
    key: Key,
) -> Result<Written<T>, ServiceError> {
    writer.entry(&key).map_err(|error| failed(format!("write value {key}"))(&error))
}

fn read<T: ZeroCopySend + Copy>(
    reader: &Reader<ipc::Service, Key>,
    key: Key,
) -> Result<Read<T>, ServiceError> {
    reader.entry(&key).map_err(|error| failed(format!("read value {key}"))(&error))
}

impl fmt::Debug for ArenaPorts {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ArenaPorts").field("sent", &self.sent).finish_non_exhaustive()
    }
}

impl fmt::Debug for AgentPorts {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("AgentPorts").field("head", &*self.head.seen).finish_non_exhaustive()
    }
}

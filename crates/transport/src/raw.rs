//! Messages as shared memory holds them: raw numbers, checked once on arrival.
//!
//! A percept is an iceoryx2 slice of [`RawDelivery`] with a [`RawPercept`] as its user header, or on a blackboard its
//! parts in several values; a command is one [`RawCommand`]. A frame that is longer than a [`RawFrame`] goes beside it,
//! whole, as a [`RawLongFrame`]: only scenarios that allow such payloads have room for these. Any process of the same user can write here, so nothing is
//! believed: [`RawCommand::check`] and [`RawHead::read`] turn bytes into checked types, or say
//! why not. Both directions keep every bit of every number, so that processes and the in-process
//! engine compute the same.

use iceoryx2::prelude::ZeroCopySend;

use crate::clock::Stamp;
use protocol::{
    command::{Answer, Command, REASON, Unreasonable, within_reason},
    frame::BodyVector,
    granted::{Compass, Position},
    notes::NOTES_MAX,
    odometry::Odometry,
    packet::{FRAME_BYTES_MAX, PacketError, PacketView, frame_bytes},
    payload::{Payload, PayloadOverLimit, SHORT_PAYLOAD_BYTES},
    percept::{COMPONENTS_MAX, Delivery, FieldComponent, Light, Percept, Stimulus, Tick, WALLS_MAX, Wall},
    robot_id::RobotId,
    units::{Meters, NotFinite, Radians},
};

/// The tick number of a command that was given before the first percept; of a percept, that the agent is to
/// forget everything and boot again: another trial begins.
pub const BOOT_TICK: Tick = Tick::MAX;

/// Longest frame that lies in a message itself, in bytes.
const SHORT_FRAME_BYTES: usize = frame_bytes(SHORT_PAYLOAD_BYTES);

/// Length of the frames of the paper's robots, whose payload is one `f32`.
const USUAL_FRAME_BYTES: usize = frame_bytes(size_of::<f32>());

/// One infrared frame, or the beginning of one that is longer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ZeroCopySend)]
#[repr(C)]
pub struct RawFrame {
    /// Length of the whole frame.
    pub len: u8,
    /// The frame, padded with zeros, or as much of it as fits.
    pub bytes: [u8; SHORT_FRAME_BYTES],
}
const _: () = assert!(size_of::<RawFrame>() == 24);

/// A frame of any length: of one that does not fit into a [`RawFrame`] all bytes, padded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ZeroCopySend)]
#[repr(C)]
pub struct RawLongFrame(pub [u8; LONG_FRAME_BYTES]);
/// [`FRAME_BYTES_MAX`] in whole words.
const LONG_FRAME_BYTES: usize = FRAME_BYTES_MAX.next_multiple_of(8);

impl RawLongFrame {
    /// All bytes of `frame`, padded with zeros.
    pub fn of(frame: &[u8]) -> Self {
        let mut long = Self::default();
        long.0[..frame.len()].copy_from_slice(frame);
        long
    }
}

impl Default for RawLongFrame {
    fn default() -> Self {
        Self([0; LONG_FRAME_BYTES])
    }
}

/// A packet as one receiver heard it.
#[derive(Clone, Copy, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
pub struct RawDelivery {
    /// Distance to the sender.
    pub range_m: f64,
    /// Direction to the sender, body frame.
    pub bearing_rad: f64,
    /// Heading of the sender relative to the receiver's.
    pub orientation_rad: f64,
    /// The frame that was heard.
    pub frame: RawFrame,
}
const _: () = assert!(size_of::<RawDelivery>() == 48);

/// The same where frames may be long.
#[derive(Clone, Copy, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
pub struct RawLongDelivery {
    /// Measurement, and the beginning of the frame.
    pub delivery: RawDelivery,
    /// The frame, if it is long.
    pub frame: RawLongFrame,
}
const _: () = assert!(size_of::<RawLongDelivery>() == 192);

/// A wall: r · (cos bearing, sin bearing) <= distance.
#[derive(Clone, Copy, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
pub struct RawWall {
    /// Distance along the normal.
    pub distance_m: f64,
    /// Bearing of the outward normal.
    pub bearing_rad: f64,
}
const _: () = assert!(size_of::<RawWall>() == 16);

/// One term of the true field: kind 0 constant (a = value), 1 Gaussian (a = amplitude, b = σ),
/// 2 lamp (a = peak, b = half distance).
#[derive(Clone, Copy, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
pub struct RawComponent {
    /// Which formula.
    pub kind: u32,
    /// Zero.
    pub padding: u32,
    /// Center, body frame.
    pub x_m: f64,
    /// Center, body frame.
    pub y_m: f64,
    /// Height.
    pub a: f64,
    /// Width in meters.
    pub b: f64,
}
const _: () = assert!(size_of::<RawComponent>() == 40);

/// Fixed part of a percept, and how much there is of the rest.
#[derive(Clone, Copy, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
pub struct RawHead {
    /// Number of the tick.
    pub tick: u64,
    /// φ at the robot.
    pub light: f64,
    /// Stimulus: gradient x, or bearing.
    pub stimulus_a: f64,
    /// Stimulus: gradient y.
    pub stimulus_b: f64,
    /// 0 none, 1 gradient, 2 bearing.
    pub stimulus_kind: u32,
    /// 1 if the bump skirt was pressed.
    pub bump: u8,
    /// 1 if there is odometry, 0 if not.
    pub has_odometry: u8,
    /// 1 if there is a compass, 0 if not.
    pub has_compass: u8,
    /// 1 if there is a position, 0 if not.
    pub has_position: u8,
    /// Walls in use.
    pub walls_len: u32,
    /// Field components in use.
    pub field_len: u32,
    /// Odometry: position, body frame of the beginning; 0 if there is none.
    pub odometry_x_m: f64,
    /// Odometry: position, body frame of the beginning; 0 if there is none.
    pub odometry_y_m: f64,
    /// Odometry: heading, body frame of the beginning; 0 if there is none.
    pub odometry_heading_rad: f64,
    /// Compass: heading, arena frame; 0 if there is none.
    pub compass_heading_rad: f64,
    /// Position, arena frame; 0 if there is none.
    pub position_x_m: f64,
    /// Position, arena frame; 0 if there is none.
    pub position_y_m: f64,
}
const _: () = assert!(size_of::<RawHead>() == 96);

/// All walls there may be; the head says how many there are.
pub type RawWalls = [RawWall; WALLS_MAX];
/// All components there may be; the head says how many there are.
pub type RawField = [RawComponent; COMPONENTS_MAX];

/// Everything of a percept but its deliveries.
#[derive(Clone, Copy, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
pub struct RawPercept {
    /// Fixed part.
    pub head: RawHead,
    /// Walls.
    pub walls: RawWalls,
    /// The true field.
    pub field: RawField,
}
const _: () = assert!(size_of::<RawPercept>() == 96 + 16 * WALLS_MAX + 40 * COMPONENTS_MAX);

/// When an agent did what in the cycle that ends with a command, by the [`Clock`](crate::clock::Clock) of the
/// machine. Nobody depends on these numbers: they are for who looks at the run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ZeroCopySend)]
#[repr(C)]
pub struct RawTimes {
    /// Stamp of the moment it woke up; 0 if it did not measure.
    pub woke: u64,
    /// In real time, stamp of the moment the percept had been read and checked, which may be long before; else 0.
    pub heard: u64,
    /// From then on until its percept was read and checked; these and the next ones are counts of the clock, and
    /// the largest `u32` for more than that.
    pub receive: u32,
    /// Until what it had heard was in its neighbor table.
    pub neighbors: u32,
    /// Until its cell was cut.
    pub cell: u32,
    /// Until that was cut to V+.
    pub truncation: u32,
    /// Until it knew its goal.
    pub centroid: u32,
    /// Until its step was done.
    pub step: u32,
    /// In the cycle before, from then until the command was sent; 0 if there was none.
    pub publish_before: u32,
    /// In real time, by how much its timer fired late, nanoseconds.
    pub late_ns: u32,
}
const _: () = assert!(size_of::<RawTimes>() == 48);

/// An agent's answer.
#[derive(Clone, Copy, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
pub struct RawCommand {
    /// The tick of the percept it answers, or [`BOOT_TICK`].
    pub tick: u64,
    /// Index of the robot.
    pub robot: u32,
    /// Its incarnation.
    pub incarnation: u16,
    /// 1 if there is an estimated error, 0 if not.
    pub has_error: u8,
    /// How many notes go with it.
    pub notes_len: u8,
    /// Estimated error, body frame; 0 if there is none.
    pub error_x_m: f64,
    /// Estimated error, body frame; 0 if there is none.
    pub error_y_m: f64,
    /// Velocity, body frame.
    pub velocity_x_m_per_s: f64,
    /// Velocity, body frame.
    pub velocity_y_m_per_s: f64,
    /// The next packet.
    pub frame: RawFrame,
    /// The agent's process, for messages about it; 0 if it has no number where the arena is.
    pub pid: u32,
    /// In real time, timer periods that went by without a cycle, in its whole life.
    pub missed: u32,
    /// How long it took.
    pub times: RawTimes,
}
const _: () = assert!(size_of::<RawCommand>() == 128);

/// All notes there may be; the command says how many there are.
pub type RawNotes = [f64; NOTES_MAX];

/// Parts of a command that do not lie in it.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Beside {
    /// The frame, if it is long.
    pub(crate) frame: RawLongFrame,
    /// Notes, as many as the command says.
    pub(crate) notes: RawNotes,
}

/// Why a command is refused.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum CommandError {
    /// It answers another tick.
    #[error("it answers tick {actual}, the arena waits for tick {expected}")]
    Tick {
        /// The tick the arena waits for.
        expected: Tick,
        /// The tick in the message.
        actual: Tick,
    },
    /// It names another robot, or another life of this one.
    #[error("it names robot {index} incarnation {incarnation}, this uplink belongs to {expected}")]
    Sender {
        /// Robot whose uplink it came through.
        expected: RobotId,
        /// The index in the message.
        index: u32,
        /// The incarnation in the message.
        incarnation: u16,
    },
    /// NaN, or beyond all reason.
    #[error(transparent)]
    Vector(#[from] Unreasonable),
    /// It neither has an estimated error nor has none.
    #[error("its flag for an estimated error is {0}, only 0 and 1 are known")]
    Flag(u8),
    /// More notes than there may be.
    #[error("it has {0} notes, at most {NOTES_MAX} are known")]
    Notes(u8),
    /// Its packet says more than the scenario allows.
    #[error(transparent)]
    Payload(#[from] PayloadOverLimit),
    /// Its packet would not decode.
    #[error("its packet does not decode: {0}")]
    Packet(#[from] PacketError),
}

/// Why a percept is refused as a whole.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum PerceptError {
    /// A number that is no quantity.
    #[error(transparent)]
    NotFinite(#[from] NotFinite),
    /// An enumeration or length out of its range.
    #[error("{what} is {value}, at most {max} is known")]
    OutOfRange {
        /// Name of the field.
        what: &'static str,
        /// Its value.
        value: u32,
        /// The largest known value.
        max: u32,
    },
    /// NaN, or beyond all reason.
    #[error("{what} is {value}, not within ±{REASON:e}")]
    Unreasonable {
        /// Name of the field.
        what: &'static str,
        /// Its value.
        value: f64,
    },
}

impl RawFrame {
    /// The frame, or the beginning of it.
    #[inline]
    pub fn of(frame: &[u8]) -> Self {
        let mut bytes = [0; SHORT_FRAME_BYTES];
        let len = frame.len().min(SHORT_FRAME_BYTES);
        bytes[..len].copy_from_slice(&frame[..len]);
        Self { len: frame.len() as u8, bytes }
    }

    /// Whether the frame is longer than what lies here.
    #[inline]
    pub fn is_long(&self) -> bool {
        usize::from(self.len) > SHORT_FRAME_BYTES
    }

    /// Checks and reads the packet of the frame, which is in `long` if it does not lie here.
    #[inline(always)]
    fn decode<'a>(&'a self, long: &'a [u8]) -> Result<PacketView<'a>, PacketError> {
        match self.usual() {
            Some(frame) => PacketView::decode(frame),
            None => self.decode_any(long),
        }
    }

    #[inline(never)]
    fn decode_any<'a>(&'a self, long: &'a [u8]) -> Result<PacketView<'a>, PacketError> {
        PacketView::decode(self.whole(long)?)
    }

    /// The whole frame if it is as long as those of the paper's robots, a length that the compiler knows.
    #[inline]
    pub(crate) fn usual(&self) -> Option<&[u8; USUAL_FRAME_BYTES]> {
        self.bytes.first_chunk().filter(|frame| usize::from(self.len) == frame.len())
    }

    /// The whole frame, from `long` if it does not lie here; that must begin as what does.
    #[inline]
    pub fn whole<'a>(&'a self, long: &'a [u8]) -> Result<&'a [u8], PacketError> {
        let len = usize::from(self.len);
        match self.bytes.get(..len) {
            Some(frame) => Ok(frame),
            None => (long.get(..len).filter(|frame| frame.starts_with(&self.bytes)))
                .ok_or(PacketError::Length { expected: len, actual: SHORT_FRAME_BYTES }),
        }
    }

    /// Number of the packet as the frame has it, whatever the rest of it is.
    pub(crate) fn sequence(&self) -> u32 {
        let bytes = &self.bytes;
        u32::from_le_bytes([bytes[8], bytes[9], bytes[10], bytes[11]])
    }
}

impl RawTimes {
    /// When the percept had been read and checked.
    pub fn received(&self) -> Stamp {
        match self.heard {
            0 => Stamp(self.woke.saturating_add(self.receive.into())),
            heard => Stamp(heard),
        }
    }

    /// When the step was done and publishing began.
    pub fn decided(&self) -> Stamp {
        let stages = [self.receive, self.neighbors, self.cell, self.truncation, self.centroid, self.step];
        Stamp(stages.iter().fold(self.woke, |stamp, &stage| stamp.saturating_add(stage.into())))
    }
}

impl RawCommand {
    /// The message that carries `answer` to `tick`, whose packet is in `frame`, by an agent that measured nothing.
    pub fn new(tick: Tick, answer: &Answer, frame: &[u8], pid: u32) -> Self {
        let Answer { sender, command, .. } = answer;
        let error = command.estimated_error.unwrap_or(BodyVector::HERE);
        Self {
            tick,
            robot: sender.index,
            incarnation: sender.incarnation,
            has_error: command.estimated_error.is_some().into(),
            notes_len: 0,
            error_x_m: error.0.x,
            error_y_m: error.0.y,
            velocity_x_m_per_s: command.velocity.0.x,
            velocity_y_m_per_s: command.velocity.0.y,
            frame: RawFrame::of(frame),
            pid,
            missed: 0,
            times: RawTimes::default(),
        }
    }

    /// The same with what the agent has measured.
    pub fn timed(self, times: RawTimes, missed: u32) -> Self {
        Self { times, missed, ..self }
    }

    /// Checks everything a command claims: tick, sender, numbers, packet. A long frame is in `long`; payloads have up
    /// to `limit` bytes.
    pub fn check(
        &self,
        long: &[u8],
        limit: usize,
        expected: RobotId,
        tick: Tick,
    ) -> Result<Answer, CommandError> {
        if self.robot != expected.index || self.incarnation != expected.incarnation {
            return Err(CommandError::Sender { expected, index: self.robot, incarnation: self.incarnation });
        }
        if self.tick != tick {
            return Err(CommandError::Tick { expected: tick, actual: self.tick });
        }
        let vector = |what, x: f64, y: f64| within_reason(what, BodyVector::new(x, y));
        let estimated_error = match self.has_error {
            0 => None,
            1 => Some(vector("estimated error", self.error_x_m, self.error_y_m)?),
            unknown => return Err(CommandError::Flag(unknown)),
        };
        let velocity = vector("velocity", self.velocity_x_m_per_s, self.velocity_y_m_per_s)?;
        if usize::from(self.notes_len) > NOTES_MAX {
            return Err(CommandError::Notes(self.notes_len));
        }
        let length = usize::from(self.frame.len).saturating_sub(frame_bytes(0));
        if length > limit {
            return Err(PayloadOverLimit { length, limit }.into());
        }
        let PacketView { sender, sequence, payload } = self.frame.decode(long)?;
        if sender != expected {
            let RobotId { index, incarnation } = sender;
            return Err(CommandError::Sender { expected, index, incarnation });
        }
        let payload = Payload::try_from(payload).expect("a decoded payload is no longer than any packet's");
        Ok(Answer { sender, sequence, command: Command { estimated_error, velocity, payload } })
    }
}

impl RawDelivery {
    /// The message that carries `delivery`, whose packet is in `frame`.
    pub fn new(delivery: &Delivery, frame: RawFrame) -> Self {
        Self {
            range_m: delivery.range.get(),
            bearing_rad: delivery.bearing.get(),
            orientation_rad: delivery.orientation.get(),
            frame,
        }
    }

    /// Checks the delivery, whose frame is in `long` if it does not lie here, and adds it to `percept`; `None` if it is
    /// not in order, or there is no room.
    #[inline]
    fn read(&self, long: &[u8], percept: &mut Percept) -> Option<()> {
        match self.frame.usual() {
            Some(frame) => self.add(frame, percept),
            None => self.read_any(long, percept),
        }
    }

    #[inline(never)]
    fn read_any(&self, long: &[u8], percept: &mut Percept) -> Option<()> {
        self.add(self.frame.whole(long).ok()?, percept)
    }

    /// The same for one whose whole frame is `frame`. Always inlined: of a length that the compiler knows, it is short.
    #[inline(always)]
    fn add(&self, frame: &[u8], percept: &mut Percept) -> Option<()> {
        let range = Meters::new(self.range_m)?;
        let bearing = Radians::new(self.bearing_rad)?;
        let orientation = Radians::new(self.orientation_rad)?;
        let packet = PacketView::decode(frame).ok()?;
        if percept.deliveries.is_full() {
            return None;
        }
        let packet = percept.packet(&packet);
        percept.deliveries.push(Delivery { packet, range, bearing, orientation });
        Some(())
    }
}

impl RawHead {
    /// The head of the message that carries `percept`.
    pub fn new(percept: &Percept) -> Self {
        let (stimulus_kind, stimulus_a, stimulus_b) = match percept.light.stimulus {
            Stimulus::None => (0, 0.0, 0.0),
            Stimulus::Gradient(gradient) => (1, gradient.0.x, gradient.0.y),
            Stimulus::Bearing(bearing) => (2, bearing.get(), 0.0),
        };
        let odometry = percept.odometry.unwrap_or_default();
        let position = percept.position.map_or([0.0; 2], |position| [position.x.get(), position.y.get()]);
        Self {
            tick: percept.tick,
            light: percept.light.value,
            stimulus_a,
            stimulus_b,
            stimulus_kind,
            bump: percept.bump.into(),
            walls_len: percept.walls.len() as u32,
            field_len: percept.field.len() as u32,
            has_odometry: percept.odometry.is_some().into(),
            odometry_x_m: odometry.position.0.x,
            odometry_y_m: odometry.position.0.y,
            odometry_heading_rad: odometry.heading.get(),
            has_compass: percept.compass.is_some().into(),
            compass_heading_rad: percept.compass.map_or(0.0, |compass| compass.heading.get()),
            has_position: percept.position.is_some().into(),
            position_x_m: position[0],
            position_y_m: position[1],
        }
    }

    /// Checks a percept but for its deliveries and writes it to `percept`, which stays as it was if something
    /// is refused. Its deliveries are none then. `walls` and `field` may be empty where the head says that there are
    /// none.
    pub fn read(
        &self,
        walls: &[RawWall],
        field: &[RawComponent],
        percept: &mut Percept,
    ) -> Result<(), PerceptError> {
        let in_range = |what, value: u32, max: usize| match value as usize <= max {
            true => Ok(value as usize),
            false => Err(PerceptError::OutOfRange { what, value, max: max as u32 }),
        };
        let walls = &walls[..in_range("number of walls", self.walls_len, WALLS_MAX)?];
        let field = &field[..in_range("number of components", self.field_len, COMPONENTS_MAX)?];
        let light = Light { value: finite(self.light, "counts")?, stimulus: self.stimulus()? };
        let (odometry, compass, position) = (self.odometry()?, self.compass()?, self.position()?);
        for wall in walls {
            wall.check()?;
        }
        for component in field {
            component.check()?;
        }
        // Nothing is written before everything is known to be good. Lists are filled in their place: they have
        // room for far more than they hold, and moving one would move all of that.
        percept.tick = self.tick;
        percept.bump = self.bump != 0;
        percept.light = light;
        (percept.odometry, percept.compass, percept.position) = (odometry, compass, position);
        percept.walls.clear();
        for wall in walls {
            percept.walls.push(wall.check()?);
        }
        percept.field.clear();
        for component in field {
            percept.field.push(component.check()?);
        }
        percept.clear_deliveries();
        Ok(())
    }

    fn stimulus(&self) -> Result<Stimulus, PerceptError> {
        match self.stimulus_kind {
            0 => Ok(Stimulus::None),
            1 => Ok(Stimulus::Gradient(BodyVector::new(
                finite(self.stimulus_a, "counts per meter")?,
                finite(self.stimulus_b, "counts per meter")?,
            ))),
            2 => Ok(Stimulus::Bearing(self.stimulus_a.try_into()?)),
            value => Err(PerceptError::OutOfRange { what: "stimulus kind", value, max: 2 }),
        }
    }

    fn odometry(&self) -> Result<Option<Odometry>, PerceptError> {
        granted("flag for odometry", self.has_odometry, || {
            Ok(Odometry {
                position: BodyVector::new(
                    reasonable("odometry x", self.odometry_x_m)?,
                    reasonable("odometry y", self.odometry_y_m)?,
                ),
                heading: reasonable("odometry heading", self.odometry_heading_rad)?.try_into()?,
            })
        })
    }

    fn compass(&self) -> Result<Option<Compass>, PerceptError> {
        granted("flag for a compass", self.has_compass, || {
            Ok(Compass { heading: reasonable("heading", self.compass_heading_rad)?.try_into()? })
        })
    }

    fn position(&self) -> Result<Option<Position>, PerceptError> {
        granted("flag for a position", self.has_position, || {
            Ok(Position {
                x: reasonable("position x", self.position_x_m)?.try_into()?,
                y: reasonable("position y", self.position_y_m)?.try_into()?,
            })
        })
    }
}

impl RawPercept {
    /// The header of the message that carries `percept`.
    pub fn new(percept: &Percept) -> Self {
        Self { head: RawHead::new(percept), walls: raw_walls(percept), field: raw_field(percept) }
    }
}

/// The walls of `percept`, padded with zeros.
pub fn raw_walls(percept: &Percept) -> RawWalls {
    let mut raw = RawWalls::default();
    for (slot, wall) in raw.iter_mut().zip(&percept.walls) {
        *slot = RawWall { distance_m: wall.distance.get(), bearing_rad: wall.bearing.get() };
    }
    raw
}

/// The true field in `percept`, padded with zeros.
pub fn raw_field(percept: &Percept) -> RawField {
    let mut raw = RawField::default();
    for (slot, component) in raw.iter_mut().zip(&percept.field) {
        *slot = RawComponent::new(component);
    }
    raw
}

/// Adds to `percept` what decodes and has room, each with the bytes of its frame if that is long; returns how many do
/// not.
#[inline]
pub fn add_deliveries<'a>(
    raw: impl IntoIterator<Item = (&'a RawDelivery, &'a [u8])>,
    percept: &mut Percept,
) -> u32 {
    raw.into_iter().filter(|(delivery, long)| delivery.read(long, percept).is_none()).count() as u32
}

impl RawWall {
    fn check(&self) -> Result<Wall, PerceptError> {
        Ok(Wall { distance: self.distance_m.try_into()?, bearing: self.bearing_rad.try_into()? })
    }
}

impl RawComponent {
    fn new(component: &FieldComponent) -> Self {
        let raw = |kind, at: BodyVector, a, b| Self { kind, padding: 0, x_m: at.0.x, y_m: at.0.y, a, b };
        match *component {
            FieldComponent::Constant(value) => raw(0, BodyVector::HERE, value, 0.0),
            FieldComponent::Gaussian { center, amplitude, sigma_m } => raw(1, center, amplitude, sigma_m),
            FieldComponent::Lamp { position, peak, half_distance_m } => {
                raw(2, position, peak, half_distance_m)
            }
        }
    }

    fn check(&self) -> Result<FieldComponent, PerceptError> {
        let at = BodyVector::new(finite(self.x_m, "meters")?, finite(self.y_m, "meters")?);
        let (a, b) = (finite(self.a, "counts")?, finite(self.b, "meters")?);
        match self.kind {
            0 => Ok(FieldComponent::Constant(a)),
            1 => Ok(FieldComponent::Gaussian { center: at, amplitude: a, sigma_m: b }),
            2 => Ok(FieldComponent::Lamp { position: at, peak: a, half_distance_m: b }),
            value => Err(PerceptError::OutOfRange { what: "component kind", value, max: 2 }),
        }
    }
}

/// The reading if `flag` says that there is one.
fn granted<T>(
    what: &'static str,
    flag: u8,
    reading: impl FnOnce() -> Result<T, PerceptError>,
) -> Result<Option<T>, PerceptError> {
    match flag {
        0 => Ok(None),
        1 => reading().map(Some),
        value => Err(PerceptError::OutOfRange { what, value: value.into(), max: 1 }),
    }
}

/// Held to the same as commands: so the difference of two readings is finite.
fn reasonable(what: &'static str, value: f64) -> Result<f64, PerceptError> {
    if value.abs() <= REASON { Ok(value) } else { Err(PerceptError::Unreasonable { what, value }) }
}

fn finite(value: f64, unit: &'static str) -> Result<f64, NotFinite> {
    if value.is_finite() { Ok(value) } else { Err(NotFinite { value, unit }) }
}

#[cfg(test)]
mod tests {

    use proptest::prelude::*;
    use protocol::packet::Frame;

    use super::*;

    const ROBOT: RobotId = RobotId { index: 7, incarnation: 2 };

    fn answer(payload: &[u8]) -> Answer {
        let command = Command {
            estimated_error: Some(BodyVector::new(0.1, -0.2)),
            velocity: BodyVector::new(0.01, -0.02),
            payload: Payload::try_from(payload).unwrap(),
        };
        Answer { sender: ROBOT, sequence: 5, command }
    }

    fn carried(answer: &Answer) -> (RawCommand, Frame) {
        let frame = answer.packet().encode();
        (RawCommand::new(12, answer, &frame, 4242), frame)
    }

    fn raw() -> RawCommand {
        carried(&answer(&[1, 2, 3, 4])).0
    }

    fn refusal(raw: RawCommand) -> String {
        raw.check(&[], 9, ROBOT, 12).unwrap_err().to_string()
    }

    #[test]
    fn a_command_survives_shared_memory_whatever_its_payload() {
        for len in [0, 4, 9, 10, 128] {
            let mut answer = answer(&[7; 128][..len]);
            for estimated_error in [answer.command.estimated_error, None] {
                answer.command.estimated_error = estimated_error;
                let (raw, frame) = carried(&answer);
                assert_eq!(raw.check(&frame, 128, ROBOT, 12).as_ref(), Ok(&answer));
                assert_eq!(raw.frame.is_long(), len > SHORT_PAYLOAD_BYTES);
            }
        }
    }

    #[test]
    fn a_payload_longer_than_the_scenario_allows_is_refused() {
        let (raw, frame) = carried(&answer(&[7; 40]));
        assert_eq!(
            raw.check(&frame, 39, ROBOT, 12).unwrap_err().to_string(),
            "its payload of 40 bytes is longer than the 39 that `channel.payload_bytes_max` allows (up to 128)"
        );
        assert!(raw.check(&frame, 40, ROBOT, 12).is_ok());
    }

    #[test]
    fn a_long_frame_that_is_not_there_or_begins_otherwise_is_refused() {
        let (raw, mut frame) = carried(&answer(&[7; 40]));
        assert!(raw.check(&[], 40, ROBOT, 12).is_err());
        frame[8] ^= 1;
        assert!(raw.check(&frame, 40, ROBOT, 12).is_err());
    }

    #[test]
    fn a_command_that_neither_has_an_error_nor_has_none_is_refused() {
        assert_eq!(
            refusal(RawCommand { has_error: 2, ..raw() }),
            "its flag for an estimated error is 2, only 0 and 1 are known"
        );
    }

    #[test]
    fn more_notes_than_there_may_be_are_refused() {
        assert_eq!(refusal(RawCommand { notes_len: 17, ..raw() }), "it has 17 notes, at most 16 are known");
    }

    #[test]
    fn a_stale_tick_is_refused() {
        assert_eq!(
            refusal(RawCommand { tick: 11, ..raw() }),
            "it answers tick 11, the arena waits for tick 12"
        );
    }

    #[test]
    fn a_foreign_incarnation_is_refused() {
        assert_eq!(
            refusal(RawCommand { incarnation: 1, ..raw() }),
            "it names robot 7 incarnation 1, this uplink belongs to robot 7 (life 3)"
        );
    }

    #[test]
    fn a_nan_velocity_is_refused() {
        assert_eq!(
            refusal(RawCommand { velocity_x_m_per_s: f64::NAN, ..raw() }),
            "its velocity is (NaN, -0.02), not within ±1e12"
        );
    }

    #[test]
    fn a_packet_longer_than_a_frame_is_refused() {
        let mut long = raw();
        long.frame.len = 200;
        assert_eq!(
            refusal(long),
            "its payload of 186 bytes is longer than the 9 that `channel.payload_bytes_max` allows (up to 128)"
        );
    }

    #[test]
    fn a_flipped_bit_is_refused() {
        let mut flipped = raw();
        flipped.frame.bytes[4] ^= 1;
        assert!(refusal(flipped).contains("checksum"));
    }

    #[test]
    fn a_packet_in_another_robots_name_is_refused() {
        let forged = Answer { sender: RobotId::first(3), ..answer(&[]) };
        let raw = RawCommand { robot: 7, incarnation: 2, ..carried(&forged).0 };
        assert!(refusal(raw).contains("names robot 3"));
    }

    fn percept() -> Percept {
        let mut percept = Percept::empty(3);
        percept.light = Light { value: 2.0, stimulus: Stimulus::Gradient(BodyVector::new(0.5, -0.0)) };
        percept.bump = true;
        let heading = Radians::new(-3.0).unwrap();
        percept.odometry = Some(Odometry { position: BodyVector::new(-0.25, 7.0), heading });
        percept.compass = Some(Compass { heading });
        percept.position = Some(Position { x: Meters::new(3.0).unwrap(), y: Meters::new(-0.0).unwrap() });
        for payload in [&[][..], &[1; 4], &[2; 9], &[3; 10], &[4; 128]] {
            let packet = percept.packet(&answer(payload).packet());
            percept.deliveries.push(Delivery {
                packet,
                range: Meters::new(0.3).unwrap(),
                bearing: Radians::new(-1.0).unwrap(),
                orientation: Radians::new(2.0).unwrap(),
            });
        }
        percept.walls.push(Wall { distance: Meters::new(1.0).unwrap(), bearing: Radians::new(0.1).unwrap() });
        percept.field.push(FieldComponent::Lamp {
            position: BodyVector::new(1.0, 2.0),
            peak: 500.0,
            half_distance_m: 0.5,
        });
        percept
    }

    fn deliveries(percept: &Percept) -> Vec<(RawDelivery, Frame)> {
        let raw = |delivery: &Delivery| {
            let frame = delivery.packet.view(percept.payload(delivery)).encode();
            (RawDelivery::new(delivery, RawFrame::of(&frame)), frame)
        };
        percept.deliveries.iter().map(raw).collect()
    }

    fn read(raw: &RawPercept, deliveries: &[(RawDelivery, Frame)]) -> (Result<u32, PerceptError>, Percept) {
        let mut percept = Percept::empty(0);
        let deliveries = deliveries.iter().map(|(delivery, frame)| (delivery, &frame[..]));
        let head = raw.head.read(&raw.walls, &raw.field, &mut percept);
        (head.map(|()| add_deliveries(deliveries, &mut percept)), percept)
    }

    #[test]
    fn times_beyond_reason_do_not_wrap_around() {
        let times = RawTimes { woke: u64::MAX - 1, receive: 5, cell: 7, ..RawTimes::default() };
        assert_eq!((times.received(), times.decided()), (Stamp(u64::MAX), Stamp(u64::MAX)));
        let times = RawTimes { woke: 100, receive: 5, cell: 7, centroid: 1, ..RawTimes::default() };
        assert_eq!((times.received(), times.decided()), (Stamp(105), Stamp(113)));
    }

    #[test]
    fn a_percept_survives_shared_memory() {
        let sent = percept();
        let (refused, received) = read(&RawPercept::new(&sent), &deliveries(&sent));
        assert_eq!((refused, &received), (Ok(0), &sent));
        let lengths: Vec<_> = received.deliveries.iter().map(|heard| received.payload(heard).len()).collect();
        assert_eq!(lengths, [0, 4, 9, 10, 128]);
    }

    #[test]
    fn a_delivery_that_does_not_decode_is_left_out_and_counted() {
        let sent = percept();
        let mut raw = deliveries(&sent);
        raw.push(raw[4].clone());
        raw[0].0.range_m = f64::NAN;
        raw[4].1[100] ^= 1;
        let (refused, received) = read(&RawPercept::new(&sent), &raw);
        assert_eq!((refused, received.deliveries.len()), (Ok(2), 4));
    }

    #[test]
    fn a_reading_that_is_no_place_or_neither_there_nor_not_is_refused() {
        let good = RawPercept::new(&percept()).head;
        let heads = [
            RawHead { odometry_x_m: f64::INFINITY, ..good },
            RawHead { odometry_heading_rad: f64::NAN, ..good },
            // Finite, but the difference of two such readings need not be.
            RawHead { odometry_y_m: -1e308, ..good },
            RawHead { odometry_heading_rad: 1e308, ..good },
            RawHead { has_odometry: 2, ..good },
            RawHead { compass_heading_rad: f64::NAN, ..good },
            RawHead { has_compass: 2, ..good },
            RawHead { position_x_m: f64::NAN, ..good },
            RawHead { position_y_m: f64::INFINITY, ..good },
            RawHead { has_position: 255, ..good },
        ];
        for head in heads {
            let (refused, received) = read(&RawPercept { head, ..RawPercept::new(&percept()) }, &[]);
            assert!(refused.is_err());
            assert_eq!(received, Percept::empty(0), "nothing of it is believed");
        }
    }

    #[test]
    fn a_percept_that_overstates_its_walls_is_refused() {
        let mut raw = RawPercept::new(&percept());
        raw.head.walls_len = 9;
        assert!(read(&raw, &[]).0.is_err());
    }

    proptest! {
        #[test]
        fn arbitrary_commands_never_panic(tick: u64, robot: u32, incarnation: u16, x: f64, has_error: u8, notes_len: u8, len: u8, bytes: [u8; SHORT_FRAME_BYTES], long: Vec<u8>) {
            let frame = RawFrame { len, bytes };
            let raw = RawCommand { tick, robot, incarnation, error_x_m: x, has_error, notes_len, frame, ..RawCommand::default() };
            let _ = raw.check(&long, 128, ROBOT, 12);
        }
    }
}

//! All that an agent gets in one tick.
//!
//! There is no number of robots in here, and unless a scenario grants a compass or a position neither pose nor
//! coordinate of the arena: what a robot knows, it heard or sensed, in its own body frame.

use alloc::vec::Vec;

use arrayvec::ArrayVec;

pub use crate::delivery::Delivery;

use crate::{
    frame::BodyVector,
    granted::{Compass, Position},
    odometry::Odometry,
    packet::{Body, Packet, PacketView},
    units::{Meters, Radians},
};

/// Most packets one robot can hear in a tick; the arena delivers the nearest and counts the rest.
pub const DELIVERIES_MAX: usize = 256;
/// Most walls a robot can sense: the sides of the arena.
pub const WALLS_MAX: usize = 8;
/// Most peaks and lamps of a sensory field.
pub const COMPONENTS_MAX: usize = 16;

/// Number of a step of virtual time, from 0.
pub type Tick = u64;

/// Direction in which the sensory function grows, as the robot senses it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stimulus {
    /// No direction: darkness, or a spot where the function is flat.
    None,
    /// The gradient of φ, per meter, body frame (Section IV of the paper).
    Gradient(BodyVector),
    /// Only the direction towards the stimulus, body frame (Section V: a ring of light sensors).
    Bearing(Radians),
}

/// The sensory function at the robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    /// φ at the robot, finite; in the units of the field (counts for lamps).
    pub value: f64,
    /// Where it grows.
    pub stimulus: Stimulus,
}

/// A straight wall: all points r of the arena satisfy r · (cos bearing, sin bearing) <= distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wall {
    /// Distance to the wall along its normal; zero or more.
    pub distance: Meters,
    /// Bearing of the outward normal, body frame.
    pub bearing: Radians,
}

/// One term of the true sensory function in the body frame. Only the `exact` controller gets
/// these, and only for comparison: no real robot knows the field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FieldComponent {
    /// The same everywhere.
    Constant(f64),
    /// amplitude · exp(−d² / 2σ²), d the distance to the center.
    Gaussian {
        /// Center, body frame.
        center: BodyVector,
        /// Value at the center.
        amplitude: f64,
        /// σ in meters, positive.
        sigma_m: f64,
    },
    /// peak / (1 + d² / h²), d the distance to the lamp, h the distance of half the peak.
    Lamp {
        /// Position, body frame.
        position: BodyVector,
        /// Response under the lamp.
        peak: f64,
        /// Distance at which half of it is left, meters, positive.
        half_distance_m: f64,
    },
}

/// All that an agent gets in one tick.
// In this order, what most percepts have lies together: each page of an agent counts as often as there are robots.
#[derive(Clone, Debug, PartialEq)]
#[repr(C)]
pub struct Percept {
    /// Which tick this is; the answer must carry the same number.
    pub tick: Tick,
    /// The light where the robot stands.
    pub light: Light,
    /// The bump skirt was pressed during the last motion.
    pub bump: bool,
    /// The robot's own motion, where the scenario gives robots odometry.
    pub odometry: Option<Odometry>,
    /// Which way the robot faces, where the scenario gives robots a compass.
    pub compass: Option<Compass>,
    /// Where the robot is, where the scenario tells robots.
    pub position: Option<Position>,
    /// Payloads that are too long to lie in their packets, one behind the other. Where there are none it has no memory.
    payloads: Vec<u8>,
    /// Walls, where the scenario gives robots boundary sensing.
    pub walls: ArrayVec<Wall, WALLS_MAX>,
    /// The true field, for the `exact` controller only; else empty.
    pub field: ArrayVec<FieldComponent, COMPONENTS_MAX>,
    /// Packets that were heard, ordered by sender index.
    pub deliveries: ArrayVec<Delivery, DELIVERIES_MAX>,
}

impl Percept {
    /// Darkness and silence at `tick`.
    pub fn empty(tick: Tick) -> Self {
        Self {
            tick,
            deliveries: ArrayVec::new(),
            light: Light { value: 0.0, stimulus: Stimulus::None },
            bump: false,
            odometry: None,
            compass: None,
            position: None,
            walls: ArrayVec::new(),
            field: ArrayVec::new(),
            payloads: Vec::new(),
        }
    }

    /// The payload of one of this percept's deliveries; of any other's, whatever lies there.
    #[inline]
    pub fn payload<'a>(&'a self, delivery: &'a Delivery) -> &'a [u8] {
        match delivery.packet.body() {
            Body::Inline(payload) => payload,
            Body::Beside { place, len } => {
                self.payloads.get(place as usize..).and_then(|rest| rest.get(..len)).unwrap_or(&[])
            }
        }
    }

    /// Returns the packet that `view` shows, for a delivery of this percept; a long payload is kept beside.
    #[inline]
    pub fn packet(&mut self, view: &PacketView<'_>) -> Packet {
        Packet::of(view, |payload| {
            let place = self.payloads.len() as u32;
            self.payloads.extend_from_slice(payload);
            place
        })
    }

    /// Removes all deliveries; their memory is kept.
    pub fn clear_deliveries(&mut self) {
        self.deliveries.clear();
        self.payloads.clear();
    }
}

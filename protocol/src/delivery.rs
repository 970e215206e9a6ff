//! A packet with the measurement of its sender.

use crate::{
    packet::Packet,
    units::{Meters, Radians},
};

/// A packet as one receiver heard it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Delivery {
    /// The packet that was heard.
    pub packet: Packet,
    /// Distance to the sender.
    pub range: Meters,
    /// Direction to the sender, body frame.
    pub bearing: Radians,
    /// Heading of the sender relative to the receiver's.
    pub orientation: Radians,
}

//! A packet that the medium lets through.

use protocol::packet::Packet;

/// One packet as one robot could read it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reception {
    /// Index of the robot that transmitted it.
    pub sender: u32,
    /// Index of the robot that hears it.
    pub receiver: u32,
    /// Number of the packet among those of its sender, by the channel's count.
    pub number: u64,
    /// When its transmission began, virtual time in seconds.
    pub sent_s: f64,
    /// Its content.
    pub packet: Packet,
}

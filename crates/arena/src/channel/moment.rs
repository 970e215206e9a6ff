//! A moment of the world, as the channel sees it.

use protocol::{packet::Packet, percept::Tick};

use crate::frame::Pose;

/// Input of the channel for one tick.
#[derive(Clone, Copy, Debug)]
pub struct Moment<'a> {
    /// Its number.
    pub tick: Tick,
    /// The neighbor cycle that begins at it, if one does.
    pub cycle: Option<u64>,
    /// Its time, seconds.
    pub time_s: f64,
    /// Where every body is.
    pub poses: &'a [Pose],
    /// Each robot's packet; a robot that is silent does not listen either.
    pub said: &'a [Option<Packet>],
}

//! All that an agent answers in one tick.

use crate::{frame::BodyVector, packet::Packet};

/// Where to go and what to say next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Command {
    /// The displacement target Ĉ − p: the estimated error ê (m, body frame). The position
    /// controller of a wheeled body steers towards it.
    pub goal: BodyVector,
    /// The velocity u = k(Ĉ − p), capped (eq. 8; m/s, body frame). A holonomic body moves with it.
    pub velocity: BodyVector,
    /// The localization packet to transmit next.
    pub packet: Packet,
}

//! All that an agent answers in one tick.

use crate::{frame::BodyVector, packet::Packet};

/// Where to go and what to say next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Command {
    /// The estimated error ê = Ĉ − p (m, body frame): how far the robot believes to be from its goal.
    /// `None` if it has no goal: it has sensed nothing yet, or has no cell, or none with mass. That is no error of
    /// zero: whoever is lost has not converged.
    pub estimated_error: Option<BodyVector>,
    /// The velocity u = k(Ĉ − p), capped (eq. 8; m/s, body frame). A holonomic body moves with it.
    pub velocity: BodyVector,
    /// The localization packet to transmit next.
    pub packet: Packet,
}

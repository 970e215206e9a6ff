//! Counts of packets by fate: an account that closes.

use serde::{Deserialize, Serialize};

/// Packets since the start of the run.
///
/// Every pair of a packet and a listener has exactly one fate, so
/// `in_range + duplicated = heard + collided + half_duplex + occluded + lost_edge + lost_loss +
/// lost_fault + over_bound + delayed` ([`Packets::check`]).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Packets {
    /// Packets transmitted, to their end.
    pub sent: u64,
    /// Packet and listener pairs within range (or Voronoi neighbors).
    pub in_range: u64,
    /// Second copies that a fault has made.
    pub duplicated: u64,
    /// Receptions: one packet heard by eight robots counts eight times.
    pub heard: u64,
    /// Receptions destroyed by another packet in the air, whether that could be read or only disturbs.
    pub collided: u64,
    /// Receptions missed because the listener was transmitting itself.
    pub half_duplex: u64,
    /// Packet and listener pairs out of range (or not Voronoi neighbors).
    pub lost_range: u64,
    /// Receptions that faded out on the soft edge of the range.
    pub lost_edge: u64,
    /// Receptions blocked by a body in the line of sight.
    pub occluded: u64,
    /// Receptions lost by the channel's own chance (`channel.loss`).
    pub lost_loss: u64,
    /// Receptions lost to a planned fault; the ledger says to which.
    pub lost_fault: u64,
    /// Receptions beyond what one percept holds; the nearest senders were kept.
    pub over_bound: u64,
    /// Receptions that a fault delays, not yet delivered.
    pub delayed: u64,
}

impl Packets {
    /// Whether the account closes; if not, both of its sides.
    pub fn check(&self) -> Result<(), String> {
        let entered = self.in_range + self.duplicated;
        let fates = [
            self.heard,
            self.collided,
            self.half_duplex,
            self.occluded,
            self.lost_edge,
            self.lost_loss,
            self.lost_fault,
            self.over_bound,
            self.delayed,
        ];
        let left: u64 = fates.iter().sum();
        match entered == left {
            true => Ok(()),
            false => Err(format!("{entered} receptions were possible, {left} are accounted for: {self:?}")),
        }
    }
}

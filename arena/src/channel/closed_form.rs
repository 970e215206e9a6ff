//! The share of packets that collisions leave, in closed form, where one is known.
//!
//! Notation: T the cycle, τ the airtime, D the guard at the end of a cycle, r = τ/T, δ = D/T,
//! k the robots that can disturb a packet (the receiver itself among them in half duplex).
//! Without capture; packets of different robots are independent.

use crate::scenario::{Access, Capture, ChannelSpec};

/// The share of packets that `k` disturbers leave on a channel whose defaults are filled in;
/// `None` where no closed form is known.
///
/// | access | share |
/// |---|---|
/// | `random` | qᵏ, q = 1 − 2r, plus (2r − δ)³/(6(1 − δ)²) if δ < 2r |
/// | `fixed-phase` | (1 − 2r)ᵏ over all phases; those of one run stay as they are |
/// | `slotted` | (1 − 1/s)ᵏ with s slots |
/// | `aligned` | (1 − 2ρ)ᵏ⁺¹ + 2/(k + 1)·[(1 − ρ)ᵏ⁺¹ − (1 − 2ρ)ᵏ⁺¹], ρ = τ/(T − D) |
pub fn delivered_share(channel: &ChannelSpec, k: u32) -> Option<f64> {
    if channel.capture != Some(Capture::None) {
        return None;
    }
    let (cycle_s, airtime_s) = (channel.cycle_s?.get(), channel.airtime_s?.get());
    let r = airtime_s / cycle_s;
    let delta = channel.guard_s.map_or(0.0, |guard| guard.get()) / cycle_s;
    let k = f64::from(k);
    match channel.access? {
        Access::Instant => None,
        Access::Random => {
            let spill = (2.0 * r - delta).max(0.0);
            let q = 1.0 - 2.0 * r + spill * spill * spill / (6.0 * (1.0 - delta) * (1.0 - delta));
            Some(libm::pow(q, k))
        }
        // Longer than half a cycle: everybody overlaps with everybody.
        Access::FixedPhase => Some(libm::pow((1.0 - 2.0 * r).max(0.0), k)),
        Access::Slotted => Some(libm::pow(1.0 - 1.0 / f64::from(channel.slots?.get()), k)),
        Access::Aligned => {
            // Beyond one half every packet overlaps with the middle of the window.
            let rho = Some(r / (1.0 - delta)).filter(|rho| *rho <= 0.5)?;
            let without = |share: f64| libm::pow((1.0 - share).max(0.0), k + 1.0);
            let inside = without(2.0 * rho);
            Some(inside + 2.0 / (k + 1.0) * (without(rho) - inside))
        }
    }
}

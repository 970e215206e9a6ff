//! The share of packets that collisions leave, in closed form, where one is known.
//!
//! Notation: T the cycle, τ the airtime, D the guard at the end of a cycle, J the jitter, r = τ/T,
//! k the robots that can disturb a packet (the receiver itself among them in half duplex).
//! Without capture, and without a soft edge unless packets that fade out on it disturb as well (where
//! `interference_range_m` is more than `range_m`); packets of different robots are independent.

use scenario::{Access, Capture, ChannelSpec};

/// The share of packets that `k` disturbers leave on a channel whose defaults are filled in;
/// `None` where no closed form is known.
///
/// | access | share |
/// |---|---|
/// | `random` | qᵏ with packets that start in a window of w = 1 − D/T, see `undisturbed_by_one` |
/// | `fixed-phase` | the same with w = J/T, over all phases; those of one run stay as they are |
/// | `slotted` | (1 − 1/s)ᵏ with s slots |
/// | `aligned` | (1 − 2ρ)ᵏ⁺¹ + 2/(k + 1)·[(1 − ρ)ᵏ⁺¹ − (1 − 2ρ)ᵏ⁺¹], ρ = τ/(T − D) |
pub fn delivered_share(channel: &ChannelSpec, k: u32) -> Option<f64> {
    let disturbs_beyond = channel.interference_range_m > channel.range_m;
    let fades = channel.soft_edge_m.is_some_and(|edge| edge.get() > 0.0) && !disturbs_beyond;
    if channel.capture != Some(Capture::None) || fades {
        return None;
    }
    let (cycle_s, airtime_s) = (channel.cycle_s?.get(), channel.airtime_s?.get());
    let share_of_cycle = |time: Option<scenario::NonNegative>| time.map_or(0.0, |time| time.get()) / cycle_s;
    let (r, delta, jitter) =
        (airtime_s / cycle_s, share_of_cycle(channel.guard_s), share_of_cycle(channel.jitter_s));
    let k = f64::from(k);
    match channel.access? {
        Access::Instant => None,
        Access::Random => Some(libm::pow(undisturbed_by_one(r, 1.0 - delta), k)),
        Access::FixedPhase => Some(libm::pow(undisturbed_by_one(r, jitter), k)),
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

/// The chance q that a robot of another phase does not disturb a packet: it sends one of a share r
/// of the cycle in each, beginning anywhere in a window of a share w of it.
///
/// Two successive packets of its are met with chance s³/(6w²) if they may be less than two airtimes
/// apart, s = 2r − (1 − w), and counted twice in 2r; so q = 1 − 2r + s³/(6w²). Packets longer than half
/// a cycle leave no room but between two that are far apart: q = (w − (2r − 1))³/(6w²).
fn undisturbed_by_one(r: f64, w: f64) -> f64 {
    let cube = |value: f64| {
        let value = value.max(0.0);
        if value > 0.0 { value * value * value / (6.0 * w * w) } else { 0.0 }
    };
    if r <= 0.5 { 1.0 - 2.0 * r + cube(2.0 * r - (1.0 - w)) } else { cube(w - (2.0 * r - 1.0)) }
}

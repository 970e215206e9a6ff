//! The share of packets that collisions leave, in closed form, where one is known.
//!
//! Notation: T the cycle, τ the airtime, D the guard at the end of a cycle, J the jitter, r = τ/T,
//! k the robots that can disturb a packet (the receiver itself among them in half duplex).
//! Without capture, and without a soft edge unless packets that fade out on it disturb as well (where
//! `interference_range_m` is more than `range_m`); packets of different robots are independent.

use scenario::{Access, Capture, ChannelModel, ChannelSpec};

/// The share of packets that `k` disturbers leave on a channel; `None` where no closed form is known.
///
/// | access | share |
/// |---|---|
/// | `random` | qᵏ with packets that start in a window of w = 1 − D/T, see `undisturbed_by_one` |
/// | `fixed-phase` | the same with w = J/T, over all phases; those of one run stay as they are |
/// | `slotted` | (1 − 1/s)ᵏ with s slots |
/// | `aligned` | (1 − 2ρ)ᵏ⁺¹ + 2/(k + 1)·[(1 − ρ)ᵏ⁺¹ − (1 − 2ρ)ᵏ⁺¹], ρ = τ/(T − D) |
pub fn delivered_share(channel: &ChannelSpec, k: u32) -> Option<f64> {
    let fades = matches!(
        channel.model,
        ChannelModel::Range { range_m, soft_edge_m, interference_range_m }
            if soft_edge_m.get() > 0.0 && interference_range_m <= range_m
    );
    let air = channel.air().filter(|air| air.capture == Capture::None && !fades)?;
    let share_of_cycle = |time_s: f64| time_s / channel.cycle_s.get();
    let r = share_of_cycle(air.airtime_s.get());
    let k = f64::from(k);
    match air.access {
        Access::Random { guard_s } => {
            Some(libm::pow(undisturbed_by_one(r, 1.0 - share_of_cycle(guard_s.get())), k))
        }
        Access::FixedPhase { jitter_s } => {
            Some(libm::pow(undisturbed_by_one(r, share_of_cycle(jitter_s.get())), k))
        }
        Access::Slotted { slots } => Some(libm::pow(1.0 - 1.0 / f64::from(slots.get()), k)),
        Access::Aligned { guard_s } => {
            // Beyond one half every packet overlaps with the middle of the window.
            let rho = Some(r / (1.0 - share_of_cycle(guard_s.get()))).filter(|rho| *rho <= 0.5)?;
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

//! How many neighbor cycles a robot that is not heard is remembered, where the scenario does not say.

use std::num::NonZeroU32;

use super::channel::{ChannelModel, ChannelSpec, Medium};
use super::fault::kind::Fault;

/// Cycles where every robot in reach is heard in each: silence means gone.
const IF_ALL_IS_HEARD: NonZeroU32 = NonZeroU32::MIN;
/// Cycles elsewhere: as many as an r-one remembers.
const IF_SOME_IS_LOST: NonZeroU32 = constant!(NonZeroU32, 4);

/// The default of `controller.neighbor_timeout_cycles` with this channel and this plan.
pub(super) fn default_cycles(channel: &ChannelSpec, plan: &[Fault]) -> NonZeroU32 {
    match loses(channel) || plan.iter().any(|fault| fault.nature().silences) {
        true => IF_SOME_IS_LOST,
        false => IF_ALL_IS_HEARD,
    }
}

/// Whether a robot in reach may go unheard for a cycle: packets collide, are lost by chance, fade at the edge of the
/// range, or are hidden by a body that passes.
fn loses(channel: &ChannelSpec) -> bool {
    let fades = matches!(channel.model, ChannelModel::Range { soft_edge_m, .. } if soft_edge_m.get() > 0.0);
    channel.medium != Medium::Instant || channel.loss.get() > 0.0 || fades || channel.occlusion
}

//! Random faults, for `lamplight fuzz`: of a kind, within the bounds of `[fuzz]`, always such that a plan may have.

use super::drawer::Drawer;
use super::kind::{Fault, FaultKind};
use super::setting::Setting;
use crate::error::Origin;

/// Draws one fault of one of these kinds for a plan in `setting`. `unit` draws evenly from 0 to 1; robot `spared` is never
/// killed. The order of the draws is fixed, here and in every kind, so that a seed keeps its plan.
pub(crate) fn drawn(
    setting: &Setting<'_>,
    kinds: &[FaultKind],
    spared: u32,
    unit: &mut dyn FnMut() -> f64,
) -> Fault {
    let mut draw = Drawer { setting, spared, unit };
    let kind = *draw.one_of(kinds);
    let window = draw.window(kind.nature().timing);
    // Of a kill, the share that is restarted is drawn with the time of it.
    let early = kind.nature().is_at_once().then(|| kind.drawn(&mut draw, &window));
    let target = draw.target(kind.nature().strikes);
    let kind = early.unwrap_or_else(|| kind.drawn(&mut draw, &window));
    Fault { window, target, kind, origin: Origin::default() }
}

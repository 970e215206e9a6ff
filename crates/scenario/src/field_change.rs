//! Changes of the field: faults of kind `field`, and the field after them.

use crate::fault::kind::{Field, Kind};
use crate::file::field::FieldSpec;
use crate::scenario::Scenario;

impl FieldSpec {
    /// Changes it as `change` says; whether it is another field now. A number that no lamp or Gaussian has changes nothing.
    pub fn change(&mut self, change: &Field) -> bool {
        let mut is_changed = set(&mut self.offset, change.offset);
        if let Some(lamp) = change.lamp.and_then(|number| self.lamp.get_mut(number as usize)) {
            is_changed |= set(&mut lamp.position_m, change.position_m);
            is_changed |= set(&mut lamp.peak, change.peak);
            is_changed |= set(&mut lamp.half_distance_m, change.half_distance_m);
        }
        if let Some(peak) = change.gaussian.and_then(|number| self.gaussian.get_mut(number as usize)) {
            is_changed |= set(&mut peak.center_m, change.center_m);
            is_changed |= set(&mut peak.sigma_m, change.sigma_m);
            is_changed |= set(&mut peak.gamma, change.gamma);
        }
        is_changed
    }
}

impl Scenario {
    /// The field at a tick, after all that the plan has changed by then.
    pub fn field_at(&self, tick: u64) -> FieldSpec {
        let mut changes: Vec<(u64, &Field)> = Vec::new();
        for fault in &self.fault {
            if let Kind::Field(change) = &fault.kind {
                changes.push((self.tick_at(fault.begins_s()), change));
            }
        }
        // Those of one tick stay in the order of the plan.
        changes.sort_by_key(|(begins, _)| *begins);
        let mut field = self.field.clone();
        for (_, change) in changes.into_iter().take_while(|(begins, _)| *begins <= tick) {
            field.change(change);
        }
        field
    }
}

/// Sets a value, if one is given; whether it is another one now.
fn set<T: Copy + PartialEq>(value: &mut T, given: Option<T>) -> bool {
    let Some(given) = given.filter(|given| given != value) else { return false };
    *value = given;
    true
}

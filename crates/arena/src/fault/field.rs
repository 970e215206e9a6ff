//! `field`: the sensory function φ changes, and stays as it is then.

use super::rule::Rule;
use scenario::{Scenario, fault};

#[derive(Debug)]
pub(super) struct Field {
    change: fault::Field,
}

impl Field {
    pub(super) fn new(change: &fault::Field, _: &Scenario) -> Self {
        Self { change: change.clone() }
    }
}

impl Rule for Field {
    fn change_field(&self, field: &mut crate::field::Field) -> bool {
        field.change(&self.change)
    }
}

//! The trait of kinds of faults, by which the rest of a plan knows them.

use schemars::JsonSchema;
use serde::de::DeserializeOwned;

use super::drawer::Drawer;
use super::entry::Entry;
use super::nature::{Nature, Window};
use crate::problem::Problem;
use crate::steps::Settling;

/// Parameters of a kind of fault: the keys that only it has, as serde reads them.
pub(super) trait Parameters: Sized + DeserializeOwned + JsonSchema {
    /// How the kind fits into a plan.
    const NATURE: Nature;

    /// Checks that the parameters can be, and do something.
    fn check(&self, _: &Entry<'_>) -> Result<(), Problem> {
        Ok(())
    }

    /// Makes times whole numbers of steps. `path` is that of a key.
    fn settle(&mut self, _path: &dyn Fn(&str) -> String, _: &mut Settling<'_>) -> Result<(), Problem> {
        Ok(())
    }

    /// Returns what comes late, and by how many seconds at most.
    fn lateness(&self) -> Option<(&'static str, f64)> {
        None
    }

    /// Leaves the first `count` robots alone; whether there is something left to strike.
    fn cut(&mut self, _count: u32) -> bool {
        true
    }

    /// Draws parameters at random, for a fault with this window.
    fn drawn(draw: &mut Drawer<'_>, window: &Window) -> Self;
}

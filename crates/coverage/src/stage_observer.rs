//! Who watches a control step go by: told of each stage as it ends.
//!
//! The controller knows no clock. Somebody outside may have one, and [`Controller::step_watched`] tells it where
//! one stage ends and the next begins. Nobody (`()`) watches for free.
//!
//! [`Controller::step_watched`]: crate::Controller::step_watched

/// Parts of a control step, in their order. Each is passed exactly once per step, even if there is nothing to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stage {
    /// What was heard is in the neighbor table.
    Neighbors,
    /// The local cell is cut, and closed where it was open.
    Cell,
    /// φ̂ is estimated and the cell is cut to V+, by the laws that do so.
    Truncation,
    /// Mass and centroid are integrated: the goal is known.
    Centroid,
}

impl Stage {
    /// All stages, in their order.
    pub const ALL: [Self; 4] = [Self::Neighbors, Self::Cell, Self::Truncation, Self::Centroid];
}

/// Somebody who is told of each stage.
pub trait StageObserver {
    /// `stage` is over.
    fn passed(&mut self, stage: Stage);
}

/// Nobody.
impl StageObserver for () {
    #[inline]
    fn passed(&mut self, _: Stage) {}
}

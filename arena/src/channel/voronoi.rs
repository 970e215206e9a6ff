//! The paper's assumption: a robot measures its Voronoi neighbors, however far they are.

use crate::{frame::ArenaPoint, voronoi::delaunay_neighbors};

/// Every Delaunay neighbor.
pub(super) fn heard(positions: &[ArenaPoint]) -> Vec<Vec<usize>> {
    delaunay_neighbors(positions)
}

//! A spatial grid: who is within a radius, at a cost that grows with the answer and not with the
//! swarm.

use std::mem;

use crate::{frame::ArenaPoint, index_lists::IndexLists};

/// Points sorted into square cells.
#[derive(Clone, Debug, Default)]
pub(crate) struct Grid {
    cell_m: f64,
    columns: usize,
    rows: usize,
    /// The points of each cell, row by row.
    cells: IndexLists,
    /// (cell, point), while it is sorted.
    entries: Vec<(usize, usize)>,
}

impl Grid {
    /// Sorts `points` of the rectangle from the origin to `size_m`, in place of those before. `radius_m` is
    /// the largest radius that will be asked for.
    pub(crate) fn sort(&mut self, points: &[ArenaPoint], size_m: [f64; 2], radius_m: f64) {
        // At most some three cells per point, whatever the radius and the shape of the rectangle.
        let (points_count, [width, height]) = (points.len().max(1) as f64, size_m);
        let roomy = (width * height / points_count).sqrt().max(width.max(height) / points_count);
        let cell_m = radius_m.max(roomy);
        let count = |length: f64| (length / cell_m).floor() as usize + 1;
        (self.cell_m, self.columns, self.rows) = (cell_m, count(width), count(height));
        let mut entries = mem::take(&mut self.entries);
        entries.clear();
        entries.extend(points.iter().zip(0..).map(|(point, index)| (self.cell_of(point), index)));
        self.cells.regroup(self.columns * self.rows, &entries);
        self.entries = entries;
    }

    /// Indices of all points that may lie within the radius of `center`: those of its cell and the
    /// eight around it, in a fixed order.
    pub(crate) fn around(&self, center: &ArenaPoint) -> impl Iterator<Item = usize> {
        let (column, row) = self.place(center);
        let columns = column.saturating_sub(1)..=(column + 1).min(self.columns - 1);
        let rows = row.saturating_sub(1)..=(row + 1).min(self.rows - 1);
        rows.flat_map(move |row| {
            let first = row * self.columns;
            self.cells.joined(first + columns.start()..first + columns.end() + 1).iter().copied()
        })
    }

    fn place(&self, point: &ArenaPoint) -> (usize, usize) {
        // `as` saturates: a point outside the rectangle belongs to the nearest cell of its border.
        let along = |value: f64, count: usize| ((value / self.cell_m) as usize).min(count - 1);
        (along(point.x, self.columns), along(point.y, self.rows))
    }

    fn cell_of(&self, point: &ArenaPoint) -> usize {
        let (column, row) = self.place(point);
        row * self.columns + column
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn nobody_within_the_radius_is_missed(
            points in proptest::collection::vec((0.0_f64..3.0, 0.0_f64..2.0), 1..60),
            radius in 0.01_f64..4.0,
        ) {
            let points: Vec<_> = points.into_iter().map(|(x, y)| ArenaPoint::new(x, y)).collect();
            let mut grid = Grid::default();
            grid.sort(&points, [3.0, 2.0], radius);
            for center in &points {
                let mut around: Vec<_> = grid.around(center).collect();
                around.sort_unstable();
                prop_assert!(around.windows(2).all(|pair| pair[0] < pair[1]), "nobody comes twice");
                for (index, point) in points.iter().enumerate() {
                    prop_assert!((point - center).norm() > radius || around.binary_search(&index).is_ok());
                }
            }
        }
    }
}

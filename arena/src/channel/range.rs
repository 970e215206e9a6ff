//! Infrared that reaches a fixed distance.

use crate::{frame::ArenaPoint, grid::Grid};

/// Everyone within `range_m`, by a spatial grid: the cost grows with packets heard.
pub(super) fn heard(positions: &[ArenaPoint], range_m: f64, size_m: [f64; 2]) -> Vec<Vec<usize>> {
    let grid = Grid::new(positions, size_m, range_m);
    positions
        .iter()
        .enumerate()
        .map(|(receiver, here)| {
            let mut senders: Vec<usize> = grid
                .around(here)
                .filter(|&sender| sender != receiver)
                .filter(|&sender| {
                    let away = positions[sender] - here;
                    libm::hypot(away.x, away.y) <= range_m
                })
                .collect();
            senders.sort_unstable();
            senders
        })
        .collect()
}

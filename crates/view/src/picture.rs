//! Cells of all robots, in the arena's frame.

use coverage::controller::Picture;

/// A place in the arena, meters.
pub(crate) type Place = [f64; 2];

/// Cells of all robots; those of one that has none are empty.
#[derive(Clone, Debug, Default)]
pub(crate) struct Pictures {
    pub(crate) cells: Vec<Vec<Place>>,
    /// V+: the part that counts; the cell where the law cuts nothing.
    pub(crate) positive: Vec<Vec<Place>>,
    pub(crate) centroids: Vec<Option<Place>>,
    pub(crate) global: Vec<Vec<Place>>,
    /// Area in which local and global cell differ, as a share of the global one.
    pub(crate) disagreement: Vec<Option<f64>>,
}

impl Pictures {
    pub(crate) fn new(poses: &[[f64; 3]], local: Vec<Option<Picture>>, global: Vec<Vec<Place>>) -> Self {
        let mut pictures = Self { global, ..Self::default() };
        for ((pose, picture), global) in poses.iter().zip(local).zip(&pictures.global) {
            let cell = picture.as_ref().map_or(Vec::new(), |it| outside(pose, &it.cell));
            let positive = picture.as_ref().and_then(|it| it.positive.as_deref());
            pictures.positive.push(positive.map_or_else(|| cell.clone(), |part| outside(pose, part)));
            let goal = picture.and_then(|it| it.goal);
            pictures.centroids.push(goal.map(|goal| outside(pose, &[goal.0])[0]));
            let whole = area(global);
            let differ = |shared: f64| (area(&cell) + whole - 2.0 * shared).max(0.0) / whole;
            let is_known = cell.len() >= 3 && whole > 0.0;
            pictures.disagreement.push(is_known.then(|| differ(shared_area(&cell, global))));
            pictures.cells.push(cell);
        }
        pictures
    }
}

/// Points of a body's frame, in the arena.
fn outside([x, y, heading]: &[f64; 3], points: &[nalgebra::Vector2<f64>]) -> Vec<Place> {
    let (sin, cos) = heading.sin_cos();
    points
        .iter()
        .map(|point| [x + cos * point.x - sin * point.y, y + sin * point.x + cos * point.y])
        .collect()
}

/// Area of a polygon whose corners go counter-clockwise.
pub(crate) fn area(polygon: &[Place]) -> f64 {
    edges(polygon).map(|([ax, ay], [bx, by])| ax * by - bx * ay).sum::<f64>() / 2.0
}

/// Area that two convex polygons share.
pub(crate) fn shared_area(a: &[Place], b: &[Place]) -> f64 {
    let mut shared = a.to_vec();
    for ([px, py], [qx, qy]) in edges(b) {
        let height = |[x, y]: Place| (qx - px) * (y - py) - (qy - py) * (x - px);
        let mut kept = Vec::with_capacity(shared.len() + 1);
        for (from, to) in edges(&shared) {
            let (above, next) = (height(from), height(to));
            if above >= 0.0 {
                kept.push(from);
            }
            if (above >= 0.0) != (next >= 0.0) {
                let share = above / (above - next);
                kept.push([from[0] + share * (to[0] - from[0]), from[1] + share * (to[1] - from[1])]);
            }
        }
        shared = kept;
    }
    area(&shared)
}

fn edges(polygon: &[Place]) -> impl Iterator<Item = (Place, Place)> {
    polygon.iter().copied().zip(polygon.iter().copied().cycle().skip(1))
}

#[cfg(test)]
mod tests {
    use super::*;

    const SQUARE: [Place; 4] = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]];

    #[test]
    fn polygons_share_what_lies_in_both() {
        assert_eq!(area(&SQUARE), 4.0);
        let beside = SQUARE.map(|[x, y]| [x + 1.0, y + 1.5]);
        assert!((shared_area(&SQUARE, &beside) - 0.5).abs() < 1e-12);
        assert_eq!(shared_area(&SQUARE, &SQUARE.map(|[x, y]| [x + 5.0, y])), 0.0);
        assert_eq!(shared_area(&[], &SQUARE), 0.0);
    }

    #[test]
    fn cells_that_agree_do_not_differ() {
        let local = |corners: &[Place]| {
            let cell = corners.iter().map(|&[x, y]| nalgebra::Vector2::new(x - 1.0, y - 1.0)).collect();
            Some(Picture { cell, positive: None, goal: None })
        };
        let poses = [[1.0, 1.0, 0.0]; 3];
        let half = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]];
        let global = vec![SQUARE.to_vec(); 3];
        let pictures = Pictures::new(&poses, vec![local(&SQUARE), local(&half), None], global);
        assert_eq!(pictures.disagreement, [Some(0.0), Some(0.5), None]);
    }
}

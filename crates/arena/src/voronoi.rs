//! The global Voronoi partition: what an observer who sees all robots would draw.
//!
//! Robots never get it. The `voronoi` channel takes its neighbors from here (the paper's
//! assumption that a robot measures its Voronoi neighbors), and metrics compare it with the cells
//! robots build themselves. Delaunay is spade's (exact predicates); cells are cut by the same code
//! as the robots'.

use crate::{delaunay::Delaunay, frame::ArenaPoint, index_lists::IndexLists};
use coverage::{
    cell::{HalfPlanes, local_cell},
    half_plane::HalfPlane,
    polygon::Polygon,
    setup::Closure,
};
use protocol::{
    percept::DELIVERIES_MAX,
    units::{Meters, Radians},
};

/// The walls bound every cell, so no closing rule is ever asked for.
const UNUSED_CLOSURE: Closure = {
    let zero = Meters::new(0.0).expect("zero is finite");
    Closure { triangle_base: zero, triangle_height: zero, close_distance: zero, cap: None }
};

/// For each point the indices of its Delaunay neighbors, ascending. A superset of the Voronoi
/// neighbors inside the arena; the excess ones cut nothing.
///
/// Points at exactly the same spot share their neighbors, and are each other's.
pub fn delaunay_neighbors(points: &[ArenaPoint]) -> IndexLists {
    Delaunay::of(points, &vec![true; points.len()]).into_neighbors()
}

/// The cell of a robot at `robot` among `others`, cut to the arena, relative to the robot in the
/// arena's axes. Of more others than a robot could hear ([`DELIVERIES_MAX`]) the nearest count.
pub fn cell_in_arena(
    robot: ArenaPoint,
    others: impl Iterator<Item = ArenaPoint>,
    size_m: [f64; 2],
) -> Polygon {
    // An observer tells apart even robots too close for each other's infrared.
    let mut others: Vec<_> = others.map(|other| other - robot).filter(|away| away.norm() > 0.0).collect();
    if others.len() > DELIVERIES_MAX {
        others.sort_by(|a, b| a.norm().total_cmp(&b.norm()));
        others.truncate(DELIVERIES_MAX);
    }
    let mut lines = HalfPlanes::new();
    lines.extend(others.iter().map(|away| {
        let bearing = Radians::new(libm::atan2(away.y, away.x)).expect("positions are finite");
        HalfPlane::bisector(libm::hypot(away.x, away.y), bearing)
    }));
    lines
        .extend(walls_around(robot, size_m).map(|(bearing, distance_m)| HalfPlane::new(bearing, distance_m)));
    local_cell(&mut lines, &UNUSED_CLOSURE).expect("four walls bound every cell")
}

/// The four walls around `robot`: bearing of the outward normal in the arena's axes, and distance.
/// Right, top, left, bottom.
pub fn walls_around(robot: ArenaPoint, [width, height]: [f64; 2]) -> [(f64, f64); 4] {
    let quarter = std::f64::consts::FRAC_PI_2;
    [(0.0, width - robot.x), (quarter, height - robot.y), (2.0 * quarter, robot.x), (-quarter, robot.y)]
}

#[cfg(test)]
mod tests {
    use coverage::moments::Moments;
    use proptest::prelude::*;

    use super::*;

    fn area(cell: &Polygon) -> f64 {
        Moments::of(cell, cell[0]).area
    }

    fn areas(points: &[ArenaPoint]) -> Vec<f64> {
        let neighbors = delaunay_neighbors(points);
        points
            .iter()
            .zip(neighbors.iter())
            .map(|(&point, near)| {
                area(&cell_in_arena(point, near.iter().map(|&other| points[other]), [1.0, 1.0]))
            })
            .collect()
    }

    #[test]
    fn a_lone_robot_owns_the_arena() {
        assert!((areas(&[ArenaPoint::new(0.3, 0.9)])[0] - 1.0).abs() < 1e-15);
    }

    #[test]
    fn robots_on_a_line_are_neighbors_along_it() {
        let line: Vec<_> = (0..5).map(|i| ArenaPoint::new(0.1 + 0.2 * f64::from(i), 0.5)).collect();
        assert_eq!(delaunay_neighbors(&line)[2], [1, 3]);
    }

    #[test]
    fn robots_on_one_spot_share_neighbors_and_cell() {
        let spot = ArenaPoint::new(0.25, 0.5);
        let shared = areas(&[spot, spot, ArenaPoint::new(0.75, 0.5)]);
        assert!(shared.iter().all(|area| (area - 0.5).abs() < 1e-15));
    }

    #[test]
    fn a_robot_amid_more_neighbors_than_it_could_hear_still_gets_a_cell() {
        let ring = (0..400).map(|i| {
            let (sin, cos) = libm::sincos(f64::from(i) * std::f64::consts::TAU / 400.0);
            ArenaPoint::new(0.5 + 0.4 * cos, 0.5 + 0.4 * sin)
        });
        let points: Vec<_> = std::iter::once(ArenaPoint::new(0.5, 0.5)).chain(ring).collect();
        // The circle of half the ring's radius, or a little more of it.
        let area = areas(&points)[0] / (std::f64::consts::PI * 0.04);
        assert!((1.0..1.2).contains(&area), "{area}");
    }

    proptest! {
        #[test]
        fn cells_tile_the_arena(
            points in proptest::collection::vec((0.0_f64..1.0, 0.0_f64..1.0), 1..80)
        ) {
            let points: Vec<_> = points.into_iter().map(|(x, y)| ArenaPoint::new(x, y)).collect();
            prop_assert!((areas(&points).iter().sum::<f64>() - 1.0).abs() < 1e-12);
        }
    }
}

//! Half-planes -> the local Voronoi cell.
//!
//! In:  bisectors and walls, body frame. Out: convex polygon, counter-clockwise, meters, body
//! frame, or `None` for a robot that knows of nothing around it.
//!
//! Every half-plane contains the robot, so the cell is the polar dual of a convex hull: sorted by
//! bearing and started at the nearest line (which always is an edge), one scan in the manner of
//! Graham finds the edges. No bounding box is needed, so nothing is lost to its size; vertices are
//! crossings of two lines, each computed once.

use arrayvec::ArrayVec;

use crate::{
    closure::{self, Closure, Opening},
    half_plane::HalfPlane,
    polygon::{HALF_PLANES_MAX, Polygon},
};

/// Neighbors nearer than this, in meters, stand on the robot itself: no bisector tells them apart.
pub const COINCIDENT_M: f64 = 1e-9;

/// Normals closer than this, in radians, are one direction: only the nearer line counts. Dropping
/// the farther one moves a vertex by at most this share of its distance.
const PARALLEL: f64 = 1e-12;

/// Half-planes a cell is cut from, in any order.
pub type HalfPlanes = ArrayVec<HalfPlane, HALF_PLANES_MAX>;

/// The cell that `lines` bound, closed by the rules of [`closure`] where they leave it open. Sorts
/// the lines and adds the closing ones; in place, because so large a table is slow to move.
pub fn local_cell(lines: &mut HalfPlanes, rules: &Closure) -> Option<Polygon> {
    let mut cell = Polygon::new();
    cut_cell(&mut cell, lines, rules);
    (!cell.is_empty()).then_some(cell)
}

/// The same as vertices of `cell`, which comes empty and stays so if there is no cell: a polygon, too,
/// is slow to move.
pub fn cut_cell(cell: &mut Polygon, lines: &mut HalfPlanes, rules: &Closure) {
    lines.sort_unstable_by(|a, b| {
        a.bearing.total_cmp(&b.bearing).then_with(|| a.distance.total_cmp(&b.distance))
    });
    let Some(nearest) = nearest(lines) else { return };
    match closure::opening(lines, rules) {
        Opening::OneBearing => cell.extend(closure::triangle(&lines[nearest], rules)),
        Opening::Gaps(closing) => {
            for line in closing {
                let at = lines.partition_point(|known| known.bearing < line.bearing);
                lines.insert(at, line);
            }
            intersect(lines, cell);
        }
    }
    closure::cap(cell, rules);
}

/// Index of the line nearest to the robot, the first of equals.
fn nearest(lines: &[HalfPlane]) -> Option<usize> {
    (0..lines.len()).min_by(|&a, &b| lines[a].distance.total_cmp(&lines[b].distance))
}

/// Fills `cell` with the polygon that half-planes sorted by bearing cut out, where no gap reaches π.
fn intersect(lines: &[HalfPlane], cell: &mut Polygon) {
    let start = nearest(lines).expect("the caller passes at least one line");
    let first = &lines[start];
    let mut hull: ArrayVec<&HalfPlane, HALF_PLANES_MAX> = ArrayVec::new();
    hull.push(first);
    for line in lines[start + 1..].iter().chain(&lines[..start]) {
        if same_direction(line, first) {
            continue;
        }
        while hull.len() > 1 && hides(line, hull[hull.len() - 1], hull[hull.len() - 2]) {
            hull.pop();
        }
        let last = hull[hull.len() - 1];
        if !same_direction(last, line) {
            hull.push(line);
        }
    }
    while hull.len() > 2 && hides(first, hull[hull.len() - 1], hull[hull.len() - 2]) {
        hull.pop();
    }
    let next = hull[1..].iter().chain(&hull[..1]);
    cell.extend(hull.iter().zip(next).map(|(line, next)| line.crossing(next)));
}

/// Whether `middle` no longer shows between `before` and `after`: their crossing lies inside it.
fn hides(after: &HalfPlane, middle: &HalfPlane, before: &HalfPlane) -> bool {
    if same_direction(middle, after) {
        return after.distance < middle.distance;
    }
    before.distance * middle.normal.perp(&after.normal) + after.distance * before.normal.perp(&middle.normal)
        <= middle.distance * before.normal.perp(&after.normal)
}

fn same_direction(a: &HalfPlane, b: &HalfPlane) -> bool {
    a.normal.dot(&b.normal) > 0.0 && a.normal.perp(&b.normal).abs() < PARALLEL
}

#[cfg(test)]
mod tests {
    use core::f64::consts::{FRAC_PI_2, PI, TAU};

    use nalgebra::Vector2;
    use proptest::prelude::*;
    use protocol::units::{Meters, Radians};

    use super::*;
    use crate::{moments::Moments, polygon::reach};

    fn rules(cap: Option<f64>) -> Closure {
        let meters = |value| Meters::new(value).unwrap();
        Closure {
            triangle_base: meters(0.6),
            triangle_height: meters(0.6),
            close_distance: meters(0.25),
            cap: cap.map(meters),
        }
    }

    fn cell_of(neighbors: &[(f64, f64)]) -> Option<Polygon> {
        let mut lines =
            neighbors.iter().map(|&(r, b)| HalfPlane::bisector(r, Radians::new(b).unwrap())).collect();
        local_cell(&mut lines, &rules(None))
    }

    fn area(cell: &[Vector2<f64>]) -> f64 {
        Moments::of(cell, cell[0]).area
    }

    #[test]
    fn a_robot_without_neighbors_has_no_cell() {
        assert_eq!(cell_of(&[]), None);
    }

    #[test]
    fn four_neighbors_around_make_a_square() {
        let cell = cell_of(&[(1.0, 0.0), (1.0, FRAC_PI_2), (1.0, PI), (1.0, -FRAC_PI_2)]).unwrap();
        assert_eq!(cell.len(), 4);
        assert!((area(&cell) - 1.0).abs() < 1e-15);
    }

    #[test]
    fn one_neighbor_gives_the_triangle_on_its_bisector() {
        let cell = cell_of(&[(0.4, 0.0)]).unwrap();
        assert_eq!(cell.len(), 3);
        assert!((area(&cell) - 0.18).abs() < 1e-15);
        assert!(cell.iter().all(|v| v.x <= 0.2 + 1e-15));
    }

    #[test]
    fn neighbors_on_one_bearing_give_the_triangle_of_the_nearest() {
        assert_eq!(cell_of(&[(0.9, 1.0), (0.4, 1.0), (0.6, 1.0)]), cell_of(&[(0.4, 1.0)]));
    }

    #[test]
    fn two_opposite_neighbors_give_a_strip_closed_on_both_sides() {
        let cell = cell_of(&[(0.4, 0.0), (0.4, PI)]).unwrap();
        assert_eq!(cell.len(), 4);
        assert!((area(&cell) - 0.4 * 0.5).abs() < 1e-12);
    }

    #[test]
    fn a_gap_of_more_than_pi_is_closed_in_its_middle() {
        let cell = cell_of(&[(0.4, 0.3), (0.4, -0.3)]).unwrap();
        let farthest_back = cell.iter().map(|v| v.x).fold(f64::INFINITY, f64::min);
        assert!((farthest_back + 0.25).abs() < 1e-12);
    }

    #[test]
    fn neighbors_at_one_spot_count_once() {
        let around = [(1.0, 0.0), (1.0, FRAC_PI_2), (1.0, PI), (1.0, -FRAC_PI_2)];
        let mut doubled = around.to_vec();
        doubled.extend(around.map(|(r, b)| (r, b + 1e-16)));
        assert!((area(&cell_of(&doubled).unwrap()) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn the_cap_holds_a_gap_just_under_pi() {
        let wide = [(0.4, 0.0), (0.4, FRAC_PI_2), (0.4, PI - 1e-4), (0.4, -2e-4)];
        let lines: HalfPlanes =
            wide.iter().map(|&(r, b)| HalfPlane::bisector(r, Radians::new(b).unwrap())).collect();
        assert!(reach(&local_cell(&mut lines.clone(), &rules(None)).unwrap()) > 100.0);
        let capped = local_cell(&mut lines.clone(), &rules(Some(1.0))).unwrap();
        assert!(reach(&capped) <= 1.0 / libm::cos(PI / 24.0) + 1e-12);
    }

    #[test]
    fn a_robot_standing_on_a_wall_keeps_its_cell() {
        let mut lines = [(0.0, 0.0), (1.0, FRAC_PI_2), (1.0, PI), (0.0, -FRAC_PI_2)]
            .iter()
            .map(|&(distance, bearing)| HalfPlane::new(bearing, distance))
            .collect();
        assert!((area(&local_cell(&mut lines, &rules(None)).unwrap()) - 1.0).abs() < 1e-15);
    }

    proptest! {
        /// The scan against the definition: a vertex lies in every half-plane, and every
        /// half-plane that touches no vertex could be dropped.
        #[test]
        fn every_vertex_lies_in_every_half_plane(
            neighbors in proptest::collection::vec((0.05_f64..1.0, 0.0..TAU), 1..40)
        ) {
            let cell = cell_of(&neighbors).unwrap();
            prop_assume!(neighbors.len() > 1);
            let slack = 1e-9 * reach(&cell).max(1.0);
            for &(range, bearing) in &neighbors {
                let line = HalfPlane::bisector(range, Radians::new(bearing).unwrap());
                for vertex in &cell {
                    prop_assert!(vertex.dot(&line.normal) <= line.distance + slack);
                }
            }
            prop_assert!(area(&cell) > 0.0);
        }

        #[test]
        fn a_cell_does_not_depend_on_the_order_of_neighbors(
            mut neighbors in proptest::collection::vec((0.05_f64..1.0, 0.0..TAU), 1..20)
        ) {
            let cell = cell_of(&neighbors);
            neighbors.reverse();
            prop_assert_eq!(cell, cell_of(&neighbors));
        }
    }
}

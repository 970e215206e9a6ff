//! Convex polygons, counter-clockwise, meters, body frame.

use arrayvec::ArrayVec;
use nalgebra::Vector2;
use protocol::percept::{DELIVERIES_MAX, WALLS_MAX};

/// Gaps of π or more that a full turn can hold: two, of exactly opposite neighbors.
pub const CLOSING_LINES_MAX: usize = 2;
/// Sides of the regular polygon that caps a cell.
pub const CAP_SIDES: usize = 24;
/// Most half-planes a cell is cut from.
pub const HALF_PLANES_MAX: usize = DELIVERIES_MAX + WALLS_MAX + CLOSING_LINES_MAX;
/// Most vertices a polygon can have: one per half-plane, cap side, and one for the cut to V+.
pub const VERTICES_MAX: usize = HALF_PLANES_MAX + CAP_SIDES + 1;

/// Corners of a triangle, counter-clockwise.
pub type Triangle = [Vector2<f64>; 3];

/// Vertices of a convex polygon in counter-clockwise order.
pub type Polygon = ArrayVec<Vector2<f64>, VERTICES_MAX>;

/// Each edge as (start, end), the closing edge included.
pub fn edges(polygon: &[Vector2<f64>]) -> impl Iterator<Item = (&Vector2<f64>, &Vector2<f64>)> {
    let (first, rest) = polygon.split_at(polygon.len().min(1));
    polygon.iter().zip(rest.iter().chain(first))
}

/// Writes over `kept` the part of a convex polygon where the affine function `height` is zero or more; empty if
/// that part has no area. Cutting a convex polygon once adds at most one vertex. In place, because a polygon is slow
/// to move.
pub fn clip(kept: &mut Polygon, polygon: &[Vector2<f64>], height: impl Fn(&Vector2<f64>) -> f64) {
    kept.clear();
    for (start, end) in edges(polygon) {
        let (above, next) = (height(start), height(end));
        if above >= 0.0 {
            kept.push(*start);
        }
        if (above > 0.0 && next < 0.0) || (above < 0.0 && next > 0.0) {
            kept.push(start + (end - start) * (above / (above - next)));
        }
    }
    if kept.len() < 3 {
        kept.clear();
    }
}

/// Distance of the farthest vertex from the robot, meters.
pub fn reach(polygon: &[Vector2<f64>]) -> f64 {
    polygon.iter().map(Vector2::norm).fold(0.0, f64::max)
}

/// Squared distance of a convex polygon from `point`, m²; zero inside, infinite from a polygon without vertices.
pub fn distance_squared(polygon: &[Vector2<f64>], point: Vector2<f64>) -> f64 {
    // Rounding may put a point on the line of a sliver inside, hence the box.
    let spans = |axis: usize| {
        polygon.iter().any(|vertex| vertex[axis] <= point[axis])
            && polygon.iter().any(|vertex| vertex[axis] >= point[axis])
    };
    let inside = |(start, end): (&Vector2<f64>, &Vector2<f64>)| (end - start).perp(&(point - start)) > 0.0;
    if spans(0) && spans(1) && edges(polygon).all(inside) {
        return 0.0;
    }
    edges(polygon)
        .map(|(start, end)| {
            let (edge, to_point) = (end - start, point - start);
            let along = (to_point.dot(&edge) / edge.norm_squared()).clamp(0.0, 1.0);
            // An edge without length is a point, and no share of it is known.
            let nearest = if along.is_nan() { Vector2::zeros() } else { edge * along };
            (to_point - nearest).norm_squared()
        })
        .fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use super::*;

    fn square() -> [Vector2<f64>; 4] {
        [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(x, y)| Vector2::new(x, y))
    }

    fn clipped(polygon: &[Vector2<f64>], height: impl Fn(&Vector2<f64>) -> f64) -> Polygon {
        let mut kept = Polygon::new();
        clip(&mut kept, polygon, height);
        kept
    }

    #[test]
    fn a_cut_through_the_middle_keeps_half() {
        let half = clipped(&square(), |v| v.x - 0.5);
        let mut xs: Vec<f64> = half.iter().map(|v| v.x).collect();
        xs.sort_by(f64::total_cmp);
        assert_eq!(xs, [0.5, 0.5, 1.0, 1.0]);
    }

    #[test]
    fn a_cut_that_touches_one_vertex_leaves_nothing() {
        assert!(clipped(&square(), |v| v.x + v.y - 2.0).is_empty());
    }

    #[test]
    fn distances_are_zero_inside_and_to_the_nearest_point_outside() {
        let from = |x, y| distance_squared(&square(), Vector2::new(x, y));
        assert_eq!([from(0.5, 0.5), from(1.0, 0.3), from(0.0, 0.0)], [0.0; 3]);
        assert_eq!([from(0.25, -2.0), from(3.0, 0.5), from(4.0, 5.0)], [4.0, 4.0, 25.0]);
        let sliver = [(0.0, 0.0), (1.0, 1.0), (1.0, 1.0)].map(|(x, y)| Vector2::new(x, y));
        assert_eq!(distance_squared(&sliver, Vector2::new(3.0, 3.0)), 8.0);
        assert_eq!(distance_squared(&[], Vector2::zeros()), f64::INFINITY);
    }

    #[test]
    fn a_cut_outside_leaves_the_polygon_alone() {
        assert_eq!(clipped(&square(), |v| v.x + 1.0).as_slice(), square());
    }
}

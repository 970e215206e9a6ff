//! The Delaunay triangulation of points that move: built anew when it has to be, kept while exact
//! predicates say that it still is the one.
//!
//! A triangulation of a strictly convex hull, all of whose triangles are counter-clockwise and all of
//! whose inner edges have the opposite vertex strictly outside the circle, is the only Delaunay
//! triangulation of its points (Delaunay 1934): building it again would give the same neighbors.
//! Looking costs a fraction of building. Triangulations are built by spade, and the predicates are those
//! it uses.

use robust::{Coord, incircle, orient2d};
use spade::{DelaunayTriangulation, HasPosition, Point2, Triangulation, handles::VertexHandle};

use crate::{frame::ArenaPoint, index_lists::IndexLists};

/// Delaunay neighbors, and what tells whether they still are.
#[derive(Clone, Debug, Default)]
pub(crate) struct Delaunay {
    neighbors: IndexLists,
    /// Which points count.
    counted: Vec<bool>,
    /// `None` if it is not worth looking at: no triangles, or two points on one spot.
    mesh: Option<Mesh>,
}

/// The triangulation by the indices of its points.
#[derive(Clone, Debug)]
struct Mesh {
    /// Counter-clockwise.
    faces: Vec<[usize; 3]>,
    /// The two faces of each inner edge: one, and the vertex of the other that it does not have.
    pairs: Vec<[usize; 4]>,
    /// Clockwise.
    hull: Vec<usize>,
}

struct Site {
    position: Point2<f64>,
    index: usize,
}

impl HasPosition for Site {
    type Scalar = f64;

    fn position(&self) -> Point2<f64> {
        self.position
    }
}

impl Delaunay {
    /// The triangulation of those `points` that are `counted`; the others have no neighbors.
    pub(crate) fn of(points: &[ArenaPoint], counted: &[bool]) -> Self {
        // Sorted, equal points stand together. They become one site.
        let mut sorted: Vec<(Point2<f64>, usize)> = points.iter().map(placed).zip(0..).collect();
        sorted.retain(|&(_, index)| counted[index]);
        sorted.sort_unstable_by(|(a, a_index), (b, b_index)| {
            a.x.total_cmp(&b.x).then_with(|| a.y.total_cmp(&b.y)).then(a_index.cmp(b_index))
        });
        let spots: Vec<&[(Point2<f64>, usize)]> = sorted.chunk_by(|(a, _), (b, _)| a == b).collect();
        let sites =
            spots.iter().enumerate().map(|(index, spot)| Site { position: spot[0].0, index }).collect();
        let triangulation = DelaunayTriangulation::<Site>::bulk_load_stable(sites)
            .expect("positions are finite, and underflow is mitigated");

        let mut vertex_of = vec![None; points.len()];
        for vertex in triangulation.vertices() {
            for &(_, index) in spots[vertex.data().index] {
                vertex_of[index] = Some(vertex);
            }
        }
        let points_at =
            |vertex: &VertexHandle<'_, Site>| spots[vertex.data().index].iter().map(|&(_, index)| index);
        // Being a neighbor is mutual: whoever enters its name into its neighbors' lists, one point
        // after the other, leaves all of them sorted.
        let mut entries = Vec::with_capacity(6 * points.len());
        for (index, vertex) in vertex_of.iter().enumerate() {
            let Some(vertex) = vertex else { continue };
            let on_the_spot = points_at(vertex).filter(|&other| other != index);
            entries.extend(on_the_spot.map(|other| (other, index)));
            let around = vertex.out_edges().map(|edge| edge.to());
            entries.extend(around.flat_map(|near| points_at(&near)).map(|other| (other, index)));
        }
        let is_plain = spots.len() == sorted.len() && triangulation.num_inner_faces() > 0;
        let index_of = |vertex: VertexHandle<'_, Site>| spots[vertex.data().index][0].1;
        Self {
            neighbors: IndexLists::grouped(points.len(), &entries),
            counted: counted.to_vec(),
            mesh: is_plain.then(|| Mesh::of(&triangulation, index_of)),
        }
    }

    /// Follows the points to where they are now.
    pub(crate) fn follow(&mut self, points: &[ArenaPoint], counted: &[bool]) {
        let stands = self.counted == counted && self.mesh.as_ref().is_some_and(|mesh| mesh.stands(points));
        if !stands {
            *self = Self::of(points, counted);
        }
    }

    /// For each point the indices of its neighbors, ascending.
    pub(crate) fn neighbors(&self) -> &IndexLists {
        &self.neighbors
    }

    /// The same, without the means to follow them.
    pub(crate) fn into_neighbors(self) -> IndexLists {
        self.neighbors
    }
}

impl Mesh {
    fn of(
        triangulation: &DelaunayTriangulation<Site>,
        index_of: impl Fn(VertexHandle<'_, Site>) -> usize,
    ) -> Self {
        let pair = |edge: spade::handles::DirectedEdgeHandle<'_, Site, (), (), ()>| {
            let (left, right) = (edge.opposite_vertex()?, edge.rev().opposite_vertex()?);
            Some([edge.from(), edge.to(), left, right].map(&index_of))
        };
        Self {
            faces: triangulation.inner_faces().map(|face| face.vertices().map(&index_of)).collect(),
            pairs: triangulation.undirected_edges().filter_map(|edge| pair(edge.as_directed())).collect(),
            hull: triangulation.convex_hull().map(|edge| index_of(edge.from())).collect(),
        }
    }

    /// Whether this is the one Delaunay triangulation of the points where they are now.
    fn stands(&self, points: &[ArenaPoint]) -> bool {
        let at = |index: usize| {
            let Point2 { x, y } = placed(&points[index]);
            Coord { x, y }
        };
        let is_outside = |&[a, b, c, d]: &[usize; 4]| incircle(at(a), at(b), at(c), at(d)) < 0.0;
        let is_upright = |&[a, b, c]: &[usize; 3]| orient2d(at(a), at(b), at(c)) > 0.0;
        // All turns to the right, and up again but once: a simple convex polygon.
        let ring = self.hull.iter().map(|&index| at(index));
        let (next, next_but_one) = (ring.clone().cycle().skip(1), ring.clone().cycle().skip(2));
        let mut corners = ring.zip(next).zip(next_but_one).map(|((a, b), c)| (a, b, c));
        let rises = |(a, b, c): (Coord<f64>, Coord<f64>, Coord<f64>)| b.y < a.y && c.y >= b.y;
        self.pairs.iter().all(is_outside)
            && self.faces.iter().all(is_upright)
            && corners.clone().all(|(a, b, c)| orient2d(a, b, c) < 0.0)
            && corners.by_ref().filter(|&corner| rises(corner)).count() == 1
    }
}

/// spade refuses coordinates so small that its predicates would underflow. The two zeros become one, so that equal
/// points stand together when they are sorted.
fn placed(point: &ArenaPoint) -> Point2<f64> {
    let Point2 { x, y } = spade::mitigate_underflow(Point2::new(point.x, point.y));
    Point2::new(x + 0.0, y + 0.0)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn points(spots: &[(f64, f64)]) -> Vec<ArenaPoint> {
        spots.iter().map(|&(x, y)| ArenaPoint::new(x, y)).collect()
    }

    #[test]
    fn a_triangulation_stands_until_an_edge_flips() {
        let mut spots = points(&[(0.0, 0.0), (1.0, 0.0), (1.0, 1.1), (0.0, 1.0), (3.0, 0.5)]);
        let counted = [true; 5];
        let delaunay = Delaunay::of(&spots, &counted);
        let mesh = delaunay.mesh.unwrap();
        spots[2].y = 1.05;
        assert!(mesh.stands(&spots));
        spots[2].y = 0.9;
        assert!(!mesh.stands(&spots), "the other diagonal is the shorter one now");
        spots[2].y = 1.0;
        assert!(!mesh.stands(&spots), "on a circle neither is, and spade has to say");
    }

    #[test]
    fn a_triangulation_turned_over_does_not_stand() {
        let spots = points(&[(0.0, 0.0), (1.0, 0.0), (1.0, 1.1), (0.0, 1.0)]);
        let mesh = Delaunay::of(&spots, &[true; 4]).mesh.unwrap();
        let mirrored: Vec<_> = spots.iter().map(|spot| ArenaPoint::new(-spot.x, spot.y)).collect();
        assert!(!mesh.stands(&mirrored));
    }

    #[test]
    fn points_that_differ_by_less_than_spade_sees_are_on_one_spot() {
        for zero in [-0.0, 1e-300] {
            let spots = points(&[(zero, 0.0), (zero, 0.5), (0.0, 0.0), (1.0, 1.0)]);
            let neighbors = Delaunay::of(&spots, &[true; 4]).into_neighbors();
            let of_each: Vec<_> = (0..4).map(|index| neighbors[index].to_vec()).collect();
            assert_eq!(of_each, [vec![1, 2, 3], vec![0, 2, 3], vec![0, 1, 3], vec![0, 1, 2]], "{zero:e}");
        }
    }

    proptest! {
        /// Steps from far less to far more than it takes to flip an edge, and robots that fall silent.
        #[test]
        fn what_is_followed_is_what_would_be_built(
            spots in proptest::collection::vec((0.0_f64..1.0, 0.0_f64..1.0), 1..40),
            steps in proptest::collection::vec((0_usize..40, -6.0_f64..0.0, -1.0_f64..1.0, -1.0_f64..1.0), 1..60),
            silent in proptest::option::of((0_usize..40, 0_usize..60)),
            coarse: bool,
        ) {
            // On a coarse lattice points meet, line up and lie on circles.
            let snapped = |value: f64| if coarse { (value * 4.0).round() / 4.0 } else { value };
            let mut free = points(&spots);
            let mut counted = vec![true; free.len()];
            let mut followed = Delaunay::default();
            for (number, (robot, size, x, y)) in steps.into_iter().enumerate() {
                let robot = robot % free.len();
                free[robot] += ArenaPoint::new(x, y) * libm::pow(10.0, size);
                if let Some((who, _)) = silent.filter(|&(_, when)| when == number) {
                    let who = who % counted.len();
                    counted[who] = false;
                }
                let placed: Vec<_> = free.iter().map(|spot| spot.map(snapped)).collect();
                followed.follow(&placed, &counted);
                let built = Delaunay::of(&placed, &counted);
                prop_assert_eq!(followed.neighbors(), built.neighbors());
            }
        }
    }
}

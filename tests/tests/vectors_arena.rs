//! `arena` and a robot's whole controller against exact arithmetic: Voronoi cells, Section V.

#![allow(clippy::unwrap_used, reason = "these are tests, helpers included")]

use arena::{Arena, frame::ArenaPoint, metrics::Partition, voronoi::delaunay_neighbors};
use coverage::{CoverageController, moments::Moments};
use nalgebra::Vector2;
use protocol::{command::Answer, controller::Hosted, frame::BodyVector, robot_id::RobotId};
use scenario::{Override, Scenario};
use serde::Deserialize;
use tests::{
    programs,
    vectors::{Pair, assert_same_polygon, points, read},
};

#[derive(Deserialize)]
struct File<C> {
    cases: Vec<C>,
}

#[test]
fn voronoi_cells_are_exact_to_1e_12() {
    #[derive(Deserialize)]
    struct Robot {
        area: f64,
        centroid: Pair,
        vertices: Vec<Pair>,
        neighbors: Vec<usize>,
    }
    #[derive(Deserialize)]
    struct Case {
        id: u32,
        kind: String,
        points: Vec<Pair>,
        robots: Vec<Robot>,
    }
    const TOLERANCE: f64 = 1e-12;
    let file: File<Case> = read("voronoi_cells");
    assert!(!file.cases.is_empty());
    for case in file.cases {
        let sites: Vec<ArenaPoint> = points(&case.points);
        let near = delaunay_neighbors(&sites);
        let partition = Partition::new(sites.clone(), [1.0, 1.0]);
        for (index, (cell, robot)) in partition.cells().iter().zip(&case.robots).enumerate() {
            let what = format!("case {} ({}), robot {index}", case.id, case.kind);
            let theirs: Vec<_> = points(&robot.vertices).iter().map(|v| v - sites[index]).collect();
            assert_same_polygon(&what, cell, &theirs, TOLERANCE);
            let moments = Moments::of(cell, cell[0]);
            assert!((moments.area - robot.area).abs() <= TOLERANCE, "{what}: area {}", moments.area);
            let centroid = sites[index] + cell[0] + moments.first / moments.area;
            let off = (centroid - Vector2::from(robot.centroid)).norm();
            assert!(off <= TOLERANCE.max(1e-15 / robot.area), "{what}: centroid off by {off:e}");
            for &neighbor in &robot.neighbors {
                assert!(
                    shares_only_a_point(&theirs, &sites, index, neighbor) || near[index].contains(&neighbor),
                    "{what}: neighbor {neighbor} is missing"
                );
            }
        }
        let total: f64 = partition.cells().iter().map(|cell| Moments::of(cell, cell[0]).area).sum();
        assert!((total - 1.0).abs() <= TOLERANCE, "case {}: cells cover {total}", case.id);
    }
}

/// Whether the edge that two robots share is shorter than the vectors' own limit of comparison.
fn shares_only_a_point(cell: &[Vector2<f64>], sites: &[ArenaPoint], own: usize, other: usize) -> bool {
    let away = sites[other] - sites[own];
    let on_bisector =
        |vertex: &&Vector2<f64>| (vertex.dot(&away) / away.norm() - away.norm() / 2.0).abs() < 1e-9;
    let shared: Vec<_> = cell.iter().filter(on_bisector).collect();
    shared.iter().flat_map(|a| shared.iter().map(move |b| (*a - *b).norm())).fold(0.0, f64::max) < 1e-8
}

/// One tick of `scenario` in process: each robot's estimated error ê in the arena's axes.
fn estimated_errors(scenario: &Scenario) -> Vec<Vector2<f64>> {
    let setup = scenario.coverage_setup(0).unwrap();
    let mut minds: Vec<_> = (0..scenario.robot_count())
        .map(RobotId::first)
        .map(|id| Hosted::new(id, CoverageController::new(id, setup)))
        .collect();
    let mut arena = Arena::new(scenario).unwrap();
    let boots: Vec<Option<Answer>> = minds.iter_mut().map(|mind| Some(mind.boot())).collect();
    let percepts = arena.tick(&boots).expect("a cycle begins at tick 0").to_vec();
    let answers: Vec<Answer> =
        minds.iter_mut().zip(&percepts).map(|(mind, percept)| mind.step(percept, &mut ())).collect();
    // The references let a robot without a goal stay where it is.
    let error = |answer: &Answer| answer.command.estimated_error.unwrap_or(BodyVector::HERE);
    answers.iter().zip(arena.poses()).map(|(answer, pose)| pose.outward(error(answer))).collect()
}

fn with(scenario: &str, sets: &[String]) -> Scenario {
    let sets: Vec<Override> = sets.iter().map(|set| set.parse().unwrap()).collect();
    Scenario::load(&programs::scenario(scenario), &sets).unwrap()
}

fn positions(pairs: &[Pair]) -> [String; 2] {
    [format!("robots.positions_m={pairs:?}"), format!("robots.count={}", pairs.len())]
}

#[test]
fn section_v_robots_head_where_exact_arithmetic_says() {
    #[derive(Deserialize)]
    struct Robot {
        kind: String,
        e_hat: Option<Pair>,
        max_vertex_dist: Option<f64>,
    }
    #[derive(Deserialize)]
    struct Case {
        id: u32,
        offset: f64,
        positions: Vec<Pair>,
        robots: Vec<Robot>,
    }
    let file: File<Case> = read("sectionV_snapshots");
    assert!(!file.cases.is_empty());
    for case in file.cases {
        let [places, count] = positions(&case.positions);
        // The snapshots' robots are points: where they stand is given, however close.
        let sets = [places, count, format!("field.offset={}", case.offset), "robots.radius_m=0".into()];
        let ours = estimated_errors(&with("swarmbots", &sets));
        for (index, (ours, robot)) in ours.iter().zip(&case.robots).enumerate() {
            let theirs = Vector2::from(robot.e_hat.unwrap_or([0.0, 0.0]));
            let off = (ours - theirs).norm();
            let tolerance = 1e-12 * robot.max_vertex_dist.unwrap_or(1.0).max(1.0);
            assert!(off <= tolerance, "case {}, robot {index} ({}): ê off by {off:e}", case.id, robot.kind);
        }
    }
}

#[test]
fn section_iv_robots_start_towards_the_reference_centroids() {
    #[derive(Deserialize)]
    struct Case {
        seed: u64,
        init: Vec<Pair>,
        chat0: Vec<Pair>,
    }
    let file: File<Case> = read("trajectories");
    assert!(!file.cases.is_empty());
    for case in file.cases {
        let errors = estimated_errors(&with("one-gaussian", &positions(&case.init)));
        for ((error, start), goal) in errors.iter().zip(&case.init).zip(&case.chat0) {
            let off = (Vector2::from(*start) + error - Vector2::from(*goal)).norm();
            assert!(off <= 1e-12, "seed {}: Ĉ off by {off:e}", case.seed);
        }
    }
}

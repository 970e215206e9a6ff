//! `coverage` against exact arithmetic: moments, V+ and its centroid, cells.

#![allow(clippy::unwrap_used, reason = "these are tests, helpers included")]

use coverage::{
    cell::{HalfPlanes, local_cell},
    centroid,
    estimate::LinearField,
    half_plane::HalfPlane,
    moments::Moments,
    polygon::Polygon,
    setup::Closure,
    third_moments::ThirdMoments,
};
use nalgebra::Vector2;
use protocol::units::{Meters, Radians};
use serde::Deserialize;
use tests::vectors::{Pair, assert_same_polygon, points, read};

#[derive(Deserialize)]
struct File<C> {
    cases: Vec<C>,
}

fn meters(value: f64) -> Meters {
    Meters::new(value).unwrap()
}

fn relative(ours: f64, theirs: f64) -> f64 {
    if ours == theirs { 0.0 } else { ((ours - theirs) / theirs).abs() }
}

#[test]
fn moments_relative_to_the_polygon_are_exact_to_1e_10() {
    #[derive(Deserialize)]
    struct Central {
        #[serde(rename = "A")]
        area: f64,
        cxx: f64,
        cxy: f64,
        cyy: f64,
    }
    #[derive(Deserialize)]
    struct Case {
        id: u32,
        kind: String,
        vertices: Vec<Pair>,
        centroid: Pair,
        central: Central,
    }
    let file: File<Case> = read("polygon_moments");
    assert!(!file.cases.is_empty());
    for case in file.cases {
        let what = format!("case {} ({})", case.id, case.kind);
        // The robot stands on the polygon: its coordinates are differences, as it would measure them.
        let polygon = points(&case.vertices);
        let robot = polygon[0];
        let local: Vec<_> = polygon.iter().map(|v| v - robot).collect();
        let rough = Moments::of(&local, Vector2::zeros());
        let center = rough.first / rough.area;
        let central = Moments::of(&local, center);
        let tolerance = 1e-10;
        assert!(relative(rough.area, case.central.area) < tolerance, "{what}: area {}", rough.area);
        let spread = (case.central.cxx * case.central.cyy).sqrt();
        for (name, ours, theirs, scale) in [
            ("cxx", central.second.m11, case.central.cxx, case.central.cxx),
            ("cyy", central.second.m22, case.central.cyy, case.central.cyy),
            ("cxy", central.second.m12, case.central.cxy, spread),
        ] {
            assert!((ours - theirs).abs() <= tolerance * scale, "{what}: {name} {ours:e} against {theirs:e}");
        }
        let size = local.iter().map(Vector2::norm).fold(0.0, f64::max);
        let [x, y] = case.centroid;
        let away = (robot + center - Vector2::new(x, y)).norm();
        let unit = f64::EPSILON * x.abs().max(y.abs());
        assert!(away <= tolerance * size + 2.0 * unit, "{what}: centroid off by {away:e}");
    }
}

#[test]
fn third_moments_are_exact_to_1e_10_of_the_polygons_size() {
    #[derive(Deserialize)]
    struct About {
        xxx: f64,
        xxy: f64,
        xyy: f64,
        yyy: f64,
    }
    #[derive(Deserialize)]
    struct Case {
        id: u32,
        kind: String,
        vertices: Vec<Pair>,
        about_vertex: About,
    }
    let file: File<Case> = read("third_moments");
    assert_eq!(file.cases.len(), 60);
    for case in file.cases {
        let polygon = points(&case.vertices);
        let local: Vec<_> = polygon.iter().map(|v| v - polygon[0]).collect();
        let ours = ThirdMoments::of(&local, Vector2::zeros());
        // A sliver is judged along and across: by its own extent in x and in y.
        let extent = |along: fn(&Vector2<f64>) -> f64| local.iter().map(along).fold(0.0, f64::max);
        let (x, y) = (extent(|v| v.x.abs()), extent(|v| v.y.abs()));
        let area = Moments::of(&local, Vector2::zeros()).area;
        for (name, ours, theirs, size) in [
            ("xxx", ours.xxx, case.about_vertex.xxx, x * x * x),
            ("xxy", ours.xxy, case.about_vertex.xxy, x * x * y),
            ("xyy", ours.xyy, case.about_vertex.xyy, x * y * y),
            ("yyy", ours.yyy, case.about_vertex.yyy, y * y * y),
        ] {
            let off = (ours - theirs).abs() / (area * size);
            assert!(off < 1e-10, "case {} ({}): {name} off by {off:e}", case.id, case.kind);
        }
    }
}

#[test]
fn estimated_mass_and_centroid_are_exact_to_1e_12() {
    #[derive(Deserialize)]
    #[allow(non_snake_case)]
    struct Case {
        id: u32,
        kind: String,
        cell: Vec<Pair>,
        p: Pair,
        phi: f64,
        grad: Pair,
        status: String,
        vplus_area: f64,
        M_hat: f64,
        C_hat: Option<Pair>,
        e_hat: Option<Pair>,
    }
    let file: File<Case> = read("vplus_centroid");
    assert!(!file.cases.is_empty());
    for case in file.cases {
        let what = format!("case {} ({})", case.id, case.kind);
        let robot = Vector2::from(case.p);
        let cell: Vec<_> = points(&case.cell).iter().map(|v| v - robot).collect();
        let estimate = LinearField { value: case.phi, gradient: Vector2::from(case.grad) };
        let mut part = Polygon::new();
        let positive = estimate.positive_part(&cell, &mut part);
        let area = positive.first().map_or(0.0, |&about| Moments::of(positive, about).area);
        assert!(
            (area - case.vplus_area).abs() <= 1e-12 * case.vplus_area.max(1e-3),
            "{what}: V+ area {area}"
        );
        let mass = centroid::mass(positive, &estimate);
        let (Some(mass), Some(e_hat)) = (mass, case.e_hat) else {
            assert!(mass.is_none() && case.C_hat.is_none(), "{what}: {} but we say {mass:?}", case.status);
            continue;
        };
        let off = (mass.centroid - Vector2::from(e_hat)).norm();
        assert!(off <= 1e-12, "{what}: Ĉ off by {off:e}");
        assert!(relative(mass.mass, case.M_hat) < 1e-9, "{what}: M̂ {} against {}", mass.mass, case.M_hat);
    }
}

#[derive(Deserialize)]
struct Heard {
    range: f64,
    bearing: f64,
}

#[test]
fn local_cells_follow_the_three_closing_rules() {
    #[derive(Deserialize)]
    struct Params {
        range: f64,
        tri_height: f64,
        tri_base: f64,
        close_dist: f64,
    }
    #[derive(Deserialize)]
    struct Case {
        id: u32,
        family: String,
        neighbors: Vec<Heard>,
        kind: String,
        vertices: Option<Vec<Pair>>,
        area: Option<f64>,
        max_vertex_dist: Option<f64>,
    }
    #[derive(Deserialize)]
    struct LocalCells {
        params: Params,
        cases: Vec<Case>,
    }
    let file: LocalCells = read("local_cells");
    let closure = Closure {
        triangle_base: meters(file.params.tri_base),
        triangle_height: meters(file.params.tri_height),
        close_distance: meters(file.params.close_dist),
        cap: None,
    };
    assert!(!file.cases.is_empty());
    for case in file.cases {
        let what = format!("case {} ({}, {})", case.id, case.family, case.kind);
        let mut lines: HalfPlanes = case
            .neighbors
            .iter()
            // The channel's cutoff, and the rule that a neighbor on the spot is ignored.
            .filter(|heard| heard.range <= file.params.range && heard.range > coverage::cell::COINCIDENT_M)
            .map(|heard| HalfPlane::bisector(heard.range, Radians::new(heard.bearing).unwrap()))
            .collect();
        let cell = local_cell(&mut lines, &closure);
        let (Some(cell), Some(vertices)) = (cell.as_ref(), case.vertices.filter(|v| !v.is_empty())) else {
            assert!(cell.is_none() && case.kind == "none", "{what}: we say {cell:?}");
            continue;
        };
        let tolerance = 1e-12 * case.max_vertex_dist.unwrap_or(1.0).max(1.0);
        assert_same_polygon(&what, cell, &points(&vertices), tolerance);
        let area = Moments::of(cell, cell[0]).area;
        let expected = case.area.unwrap();
        assert!((area - expected).abs() <= tolerance * expected.max(1.0), "{what}: area {area}");
    }
}

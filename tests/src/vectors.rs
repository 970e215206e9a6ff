//! Reference vectors: numbers computed independently of this code, in exact or high-precision
//! arithmetic. `LAMPLIGHT_VECTORS` names another folder of the same kind.

use std::{env, fs, path::PathBuf};

use nalgebra::Vector2;
use serde::de::DeserializeOwned;

/// Reads `NAME.json`.
///
/// # Panics
/// If the file is missing or has another shape: a test that reads nothing must not pass.
pub fn read<T: DeserializeOwned>(name: &str) -> T {
    let folder = env::var_os("LAMPLIGHT_VECTORS")
        .map_or_else(|| PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/vectors")), PathBuf::from);
    let path = folder.join(name).with_extension("json");
    let text = fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    serde_json::from_str(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// A pair as the files hold it.
pub type Pair = [f64; 2];

/// Pairs as vectors.
pub fn points(pairs: &[Pair]) -> Vec<Vector2<f64>> {
    pairs.iter().map(|&[x, y]| Vector2::new(x, y)).collect()
}

/// Asserts that two convex polygons are one: every vertex of either lies within `tolerance` of the
/// other's boundary. Indifferent to where the list starts, to doubled vertices, and to how far a
/// vertex between two nearly parallel edges slides along them.
///
/// # Panics
/// If they are not.
pub fn assert_same_polygon(what: &str, ours: &[Vector2<f64>], theirs: &[Vector2<f64>], tolerance: f64) {
    let farthest = |from: &[Vector2<f64>], to: &[Vector2<f64>]| {
        from.iter().map(|vertex| distance_to_boundary(vertex, to)).fold(0.0, f64::max)
    };
    let (extra, missing) = (farthest(ours, theirs), farthest(theirs, ours));
    assert!(
        extra <= tolerance && missing <= tolerance,
        "{what}: boundaries differ by {extra:e} and {missing:e}, tolerance {tolerance:e}\n\
         ours   {ours:?}\ntheirs {theirs:?}"
    );
}

fn distance_to_boundary(point: &Vector2<f64>, polygon: &[Vector2<f64>]) -> f64 {
    let edges = polygon.iter().zip(polygon.iter().cycle().skip(1));
    edges
        .map(|(start, end)| {
            let (edge, away) = (end - start, point - start);
            let length_squared = edge.norm_squared();
            let along =
                if length_squared > 0.0 { (away.dot(&edge) / length_squared).clamp(0.0, 1.0) } else { 0.0 };
            (away - edge * along).norm()
        })
        .fold(f64::INFINITY, f64::min)
}

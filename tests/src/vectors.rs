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

/// Asserts that every vertex of one polygon lies within `tolerance` of the other's boundary
/// vertices, both ways: the comparison is cyclic and indifferent to doubled vertices.
///
/// # Panics
/// If one does not.
pub fn assert_same_vertices(what: &str, ours: &[Vector2<f64>], theirs: &[Vector2<f64>], tolerance: f64) {
    let lonely = |from: &[Vector2<f64>], to: &[Vector2<f64>]| {
        from.iter()
            .map(|a| to.iter().map(|b| (a - b).norm()).fold(f64::INFINITY, f64::min))
            .fold(0.0, f64::max)
    };
    let (extra, missing) = (lonely(ours, theirs), lonely(theirs, ours));
    assert!(
        extra <= tolerance && missing <= tolerance,
        "{what}: vertices differ by {extra:e} and {missing:e}, tolerance {tolerance:e}\nours   {ours:?}\ntheirs {theirs:?}"
    );
}

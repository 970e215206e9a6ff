//! Places as viewers are told them.

use arena::frame::Pose;
use recording::foxglove::{self, Quaternion, Vector3};

/// Frame that places are in.
pub(super) const ARENA: &str = "arena";

/// The nearest number that single precision has: more bits would not compress, and nobody sees them.
pub(super) fn single(value: f64) -> f64 {
    f64::from(value as f32)
}

/// A robot's pose.
pub(super) fn shown(pose: &Pose) -> foxglove::Pose {
    let (sin, cos) = (pose.heading / 2.0).sin_cos();
    let orientation = Quaternion { z: single(sin), w: single(cos), ..Quaternion::default() };
    let at = at([single(pose.position.x), single(pose.position.y)]);
    foxglove::Pose { orientation: Some(orientation), ..at }
}

/// A place, without a turn.
pub(super) fn at([x, y]: [f64; 2]) -> foxglove::Pose {
    foxglove::Pose {
        position: Some(Vector3 { x, y, z: 0.0 }),
        orientation: Some(Quaternion { w: 1.0, ..Quaternion::default() }),
    }
}

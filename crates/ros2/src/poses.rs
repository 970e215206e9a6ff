//! Poses as ROS 2 has them.

use recording::foxglove;

use crate::messages::{Header, Point, Pose, PoseArray, Quaternion, TfMessage, Transform, TransformStamped};

/// A recorded pose. A place or a turn that it does not say is none.
pub(crate) fn pose(recorded: &foxglove::Pose) -> Pose {
    let turn = recorded.orientation.map(|it| Quaternion { x: it.x, y: it.y, z: it.z, w: it.w });
    Pose {
        position: recorded.position.as_ref().map(vector).unwrap_or_default(),
        orientation: turn.unwrap_or_default(),
    }
}

/// A recorded vector.
pub(crate) fn vector(recorded: &foxglove::Vector3) -> Point {
    Point { x: recorded.x, y: recorded.y, z: recorded.z }
}

/// All robots by number, as poses and as frames: `robot_0`, `robot_1` and so on.
pub(crate) fn robots(recorded: &[foxglove::Pose], header: &Header) -> (TfMessage, PoseArray) {
    let poses: Vec<Pose> = recorded.iter().map(pose).collect();
    let transform = |(robot, pose): (usize, &Pose)| TransformStamped {
        header: header.clone(),
        child_frame_id: format!("robot_{robot}"),
        transform: Transform { translation: pose.position, rotation: pose.orientation },
    };
    let transforms = poses.iter().enumerate().map(transform).collect();
    (TfMessage { transforms }, PoseArray { header: header.clone(), poses })
}

//! Messages of ROS 2 as far as bags of ours have them: fields in the order of their definitions, which is all that CDR goes
//! by.
//!
//! Source: `common_interfaces`, `geometry2`, `rcl_interfaces` of ROS 2 Humble. Later distributions have the same fields.

use serde::Serialize;

use crate::definitions::MessageType;

/// A message that has a topic of its own.
pub(crate) trait Message: Serialize {
    /// Its type.
    const TYPE: MessageType;
}

/// `rosgraph_msgs/msg/Clock`.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub(crate) struct Clock {
    pub(crate) clock: Time,
}

impl Message for Clock {
    const TYPE: MessageType = MessageType::Clock;
}

/// `tf2_msgs/msg/TFMessage`.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub(crate) struct TfMessage {
    pub(crate) transforms: Vec<TransformStamped>,
}

impl Message for TfMessage {
    const TYPE: MessageType = MessageType::TfMessage;
}

/// `geometry_msgs/msg/PoseArray`.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub(crate) struct PoseArray {
    pub(crate) header: Header,
    pub(crate) poses: Vec<Pose>,
}

impl Message for PoseArray {
    const TYPE: MessageType = MessageType::PoseArray;
}

/// `visualization_msgs/msg/MarkerArray`.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub(crate) struct MarkerArray {
    pub(crate) markers: Vec<Marker>,
}

impl Message for MarkerArray {
    const TYPE: MessageType = MessageType::MarkerArray;
}

/// `std_msgs/msg/Float64`.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub(crate) struct Float64 {
    pub(crate) data: f64,
}

impl Message for Float64 {
    const TYPE: MessageType = MessageType::Float64;
}

/// `builtin_interfaces/msg/Time`, and `Duration`, which has the same fields.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub(crate) struct Time {
    pub(crate) sec: i32,
    pub(crate) nanosec: u32,
}

impl Time {
    /// Nanoseconds as messages have them. The last second that they can name stands for all later ones: 68 years.
    pub(crate) fn of(time_ns: u64) -> Self {
        const NS_PER_S: u64 = 1_000_000_000;
        let sec = i32::try_from(time_ns / NS_PER_S).unwrap_or(i32::MAX);
        Self { sec, nanosec: (time_ns % NS_PER_S) as u32 }
    }
}

/// `std_msgs/msg/Header`.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub(crate) struct Header {
    pub(crate) stamp: Time,
    pub(crate) frame_id: String,
}

/// `geometry_msgs/msg/TransformStamped`.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub(crate) struct TransformStamped {
    pub(crate) header: Header,
    pub(crate) child_frame_id: String,
    pub(crate) transform: Transform,
}

/// `geometry_msgs/msg/Transform`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub(crate) struct Transform {
    pub(crate) translation: Point,
    pub(crate) rotation: Quaternion,
}

/// `geometry_msgs/msg/Pose`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub(crate) struct Pose {
    pub(crate) position: Point,
    pub(crate) orientation: Quaternion,
}

/// `geometry_msgs/msg/Point`, and `Vector3`, which has the same fields.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub(crate) struct Point {
    pub(crate) x: f64,
    pub(crate) y: f64,
    pub(crate) z: f64,
}

/// `geometry_msgs/msg/Quaternion`: no turn unless it says one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(crate) struct Quaternion {
    pub(crate) x: f64,
    pub(crate) y: f64,
    pub(crate) z: f64,
    pub(crate) w: f64,
}

impl Default for Quaternion {
    fn default() -> Self {
        Self { x: 0.0, y: 0.0, z: 0.0, w: 1.0 }
    }
}

/// `std_msgs/msg/ColorRGBA`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub(crate) struct Color {
    pub(crate) r: f32,
    pub(crate) g: f32,
    pub(crate) b: f32,
    pub(crate) a: f32,
}

/// `visualization_msgs/msg/Marker`.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub(crate) struct Marker {
    pub(crate) header: Header,
    pub(crate) ns: String,
    pub(crate) id: i32,
    pub(crate) r#type: i32,
    pub(crate) action: i32,
    pub(crate) pose: Pose,
    pub(crate) scale: Point,
    pub(crate) color: Color,
    pub(crate) lifetime: Time,
    pub(crate) frame_locked: bool,
    pub(crate) points: Vec<Point>,
    pub(crate) colors: Vec<Color>,
    pub(crate) texture_resource: String,
    pub(crate) texture: CompressedImage,
    pub(crate) uv_coordinates: Vec<[f32; 2]>,
    pub(crate) text: String,
    pub(crate) mesh_resource: String,
    pub(crate) mesh_file: MeshFile,
    pub(crate) mesh_use_embedded_materials: bool,
}

impl Marker {
    /// A ball, as a `type`.
    pub(crate) const SPHERE: i32 = 2;
    /// A cylinder that stands, as a `type`.
    pub(crate) const CYLINDER: i32 = 3;
    /// Lines between pairs of points, as a `type`.
    pub(crate) const LINE_LIST: i32 = 5;
    /// Shows it, or changes what is shown, as an `action`.
    pub(crate) const ADD: i32 = 0;
    /// Shows it no longer, as an `action`.
    pub(crate) const DELETE: i32 = 2;
}

/// `sensor_msgs/msg/CompressedImage`.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub(crate) struct CompressedImage {
    pub(crate) header: Header,
    pub(crate) format: String,
    pub(crate) data: Vec<u8>,
}

/// `visualization_msgs/msg/MeshFile`.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub(crate) struct MeshFile {
    pub(crate) filename: String,
    pub(crate) data: Vec<u8>,
}

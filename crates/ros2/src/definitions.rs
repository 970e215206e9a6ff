//! Definitions of messages, as bags bring them along for readers that have not installed them.
//!
//! Source: `common_interfaces`, `geometry2` and `rcl_interfaces` of ROS 2 Humble, without their comments.

/// The type of a message that has a topic of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum MessageType {
    Clock,
    TfMessage,
    PoseArray,
    MarkerArray,
    Float64,
}

impl MessageType {
    pub(crate) const ALL: [Self; 5] =
        [Self::Clock, Self::TfMessage, Self::PoseArray, Self::MarkerArray, Self::Float64];

    /// Its full name.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Clock => "rosgraph_msgs/msg/Clock",
            Self::TfMessage => "tf2_msgs/msg/TFMessage",
            Self::PoseArray => "geometry_msgs/msg/PoseArray",
            Self::MarkerArray => "visualization_msgs/msg/MarkerArray",
            Self::Float64 => "std_msgs/msg/Float64",
        }
    }

    /// Its hash (REP 2016), by which ROS 2 from Iron on tells whether two nodes mean the same by its name.
    pub(crate) fn hash(self) -> &'static str {
        match self {
            Self::Clock => "RIHS01_692f7a66e93a3c83e71765d033b60349ba68023a8c689a79e48078bcb5c58564",
            Self::TfMessage => "RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087",
            Self::PoseArray => "RIHS01_af0cc36d190e104d546d168d6b39df04fa4b4ccecf59cb4c9ed328d3d5004aa0",
            Self::MarkerArray => "RIHS01_86cb8800b6fb05b5eff1abd7a56f62a5641d3ae9a1c29e78e67e704f1d067dcf",
            Self::Float64 => "RIHS01_705ba9c3d1a09df43737eb67095534de36fd426c0587779bda2bc51fe790182a",
        }
    }

    /// Its definition, followed by those of all that it is made of.
    pub(crate) fn definition(self) -> String {
        let (own, parts): (&str, &[Part]) = match self {
            Self::Clock => ("builtin_interfaces/Time clock\n", &[TIME]),
            Self::TfMessage => (
                "geometry_msgs/TransformStamped[] transforms\n",
                &[TRANSFORM_STAMPED, HEADER, TIME, TRANSFORM, VECTOR3, QUATERNION],
            ),
            Self::PoseArray => {
                ("std_msgs/Header header\nPose[] poses\n", &[HEADER, TIME, POSE, POINT, QUATERNION])
            }
            Self::MarkerArray => (
                "Marker[] markers\n",
                &[
                    MARKER,
                    HEADER,
                    TIME,
                    POSE,
                    POINT,
                    QUATERNION,
                    VECTOR3,
                    COLOR,
                    DURATION,
                    COMPRESSED_IMAGE,
                    UV_COORDINATE,
                    MESH_FILE,
                ],
            ),
            Self::Float64 => ("float64 data\n", &[]),
        };
        let rule = "=".repeat(80);
        let mut text = own.to_owned();
        for Part(name, definition) in parts {
            text += &format!("{rule}\nMSG: {name}\n{definition}");
        }
        text
    }
}

/// A type that others are made of, and its definition.
struct Part(&'static str, &'static str);

const TIME: Part = Part("builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n");
const DURATION: Part = Part("builtin_interfaces/Duration", "int32 sec\nuint32 nanosec\n");
const HEADER: Part = Part("std_msgs/Header", "builtin_interfaces/Time stamp\nstring frame_id\n");
const COLOR: Part = Part("std_msgs/ColorRGBA", "float32 r\nfloat32 g\nfloat32 b\nfloat32 a\n");
const POINT: Part = Part("geometry_msgs/Point", "float64 x\nfloat64 y\nfloat64 z\n");
const VECTOR3: Part = Part("geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n");
const QUATERNION: Part =
    Part("geometry_msgs/Quaternion", "float64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n");
const POSE: Part = Part("geometry_msgs/Pose", "Point position\nQuaternion orientation\n");
const TRANSFORM: Part = Part("geometry_msgs/Transform", "Vector3 translation\nQuaternion rotation\n");
const TRANSFORM_STAMPED: Part = Part(
    "geometry_msgs/TransformStamped",
    "std_msgs/Header header\nstring child_frame_id\nTransform transform\n",
);
const COMPRESSED_IMAGE: Part =
    Part("sensor_msgs/CompressedImage", "std_msgs/Header header\nstring format\nuint8[] data\n");
const UV_COORDINATE: Part = Part("visualization_msgs/UVCoordinate", "float32 u\nfloat32 v\n");
const MESH_FILE: Part = Part("visualization_msgs/MeshFile", "string filename\nuint8[] data\n");
const MARKER: Part = Part(
    "visualization_msgs/Marker",
    "\
int32 ARROW=0
int32 CUBE=1
int32 SPHERE=2
int32 CYLINDER=3
int32 LINE_STRIP=4
int32 LINE_LIST=5
int32 CUBE_LIST=6
int32 SPHERE_LIST=7
int32 POINTS=8
int32 TEXT_VIEW_FACING=9
int32 MESH_RESOURCE=10
int32 TRIANGLE_LIST=11
int32 ADD=0
int32 MODIFY=0
int32 DELETE=2
int32 DELETEALL=3
std_msgs/Header header
string ns
int32 id
int32 type
int32 action
geometry_msgs/Pose pose
geometry_msgs/Vector3 scale
std_msgs/ColorRGBA color
builtin_interfaces/Duration lifetime
bool frame_locked
geometry_msgs/Point[] points
std_msgs/ColorRGBA[] colors
string texture_resource
sensor_msgs/CompressedImage texture
UVCoordinate[] uv_coordinates
string text
string mesh_resource
MeshFile mesh_file
bool mesh_use_embedded_materials
",
);

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    /// Types that no definition explains.
    const BASIC: [&str; 7] = ["bool", "uint8", "int32", "uint32", "float32", "float64", "string"];

    #[test]
    fn each_definition_explains_each_type_it_names_once() {
        for message in MessageType::ALL {
            let text = message.definition();
            let (package, _) = message.name().split_once('/').unwrap();
            let (mut explained, mut named) = (BTreeSet::new(), BTreeSet::new());
            for part in format!("MSG: {package}/Own\n{text}").split(&format!("{}\n", "=".repeat(80))) {
                let (name, fields) = part.strip_prefix("MSG: ").unwrap().split_once('\n').unwrap();
                assert!(explained.insert(name.to_owned()), "{name} twice");
                let (package, _) = name.split_once('/').unwrap();
                let types = fields.lines().map(|line| line.split_once(' ').unwrap().0);
                let types =
                    types.map(|name| name.trim_end_matches("[]")).filter(|name| !BASIC.contains(name));
                named.extend(types.map(|name| match name.contains('/') {
                    true => name.to_owned(),
                    false => format!("{package}/{name}"),
                }));
            }
            explained.remove(&format!("{package}/Own"));
            assert_eq!(explained, named, "{}", message.name());
        }
    }
}

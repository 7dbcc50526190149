//! Names and definitions of the messages, as their recordings carry them.

use std::fmt::Write;

/// A kind of message that this program writes or reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Kind {
    /// A revolution of a laser.
    LaserScan,
    /// Rates and accelerations.
    Imu,
    /// Integrated odometry.
    Odometry,
    /// A pose with its covariance.
    PoseWithCovarianceStamped,
    /// A pose.
    PoseStamped,
    /// Transforms between frames.
    Transforms,
    /// Things to draw.
    Markers,
    /// How the parts of the vehicle are.
    Diagnostics,
}

impl Kind {
    /// Its name in ROS 2.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::LaserScan => "sensor_msgs/msg/LaserScan",
            Self::Imu => "sensor_msgs/msg/Imu",
            Self::Odometry => "nav_msgs/msg/Odometry",
            Self::PoseWithCovarianceStamped => "geometry_msgs/msg/PoseWithCovarianceStamped",
            Self::PoseStamped => "geometry_msgs/msg/PoseStamped",
            Self::Transforms => "tf2_msgs/msg/TFMessage",
            Self::Markers => "visualization_msgs/msg/MarkerArray",
            Self::Diagnostics => "diagnostic_msgs/msg/DiagnosticArray",
        }
    }
}

/// Each type with its fields, separated by semicolons.
const TYPES: [(&str, &str); 27] = [
    ("builtin_interfaces/Time", "int32 sec;uint32 nanosec"),
    ("builtin_interfaces/Duration", "int32 sec;uint32 nanosec"),
    ("std_msgs/Header", "builtin_interfaces/Time stamp;string frame_id"),
    ("std_msgs/ColorRGBA", "float32 r;float32 g;float32 b;float32 a"),
    ("geometry_msgs/Point", "float64 x;float64 y;float64 z"),
    ("geometry_msgs/Vector3", "float64 x;float64 y;float64 z"),
    ("geometry_msgs/Quaternion", "float64 x;float64 y;float64 z;float64 w"),
    ("geometry_msgs/Pose", "geometry_msgs/Point position;geometry_msgs/Quaternion orientation"),
    ("geometry_msgs/Transform", "geometry_msgs/Vector3 translation;geometry_msgs/Quaternion rotation"),
    ("geometry_msgs/Twist", "geometry_msgs/Vector3 linear;geometry_msgs/Vector3 angular"),
    ("geometry_msgs/PoseWithCovariance", "geometry_msgs/Pose pose;float64[36] covariance"),
    ("geometry_msgs/TwistWithCovariance", "geometry_msgs/Twist twist;float64[36] covariance"),
    ("geometry_msgs/PoseStamped", "std_msgs/Header header;geometry_msgs/Pose pose"),
    ("geometry_msgs/PoseWithCovarianceStamped", "std_msgs/Header header;geometry_msgs/PoseWithCovariance pose"),
    (
        "geometry_msgs/TransformStamped",
        "std_msgs/Header header;string child_frame_id;geometry_msgs/Transform transform",
    ),
    ("tf2_msgs/TFMessage", "geometry_msgs/TransformStamped[] transforms"),
    (
        "nav_msgs/Odometry",
        "std_msgs/Header header;string child_frame_id;geometry_msgs/PoseWithCovariance pose;\
         geometry_msgs/TwistWithCovariance twist",
    ),
    (
        "sensor_msgs/LaserScan",
        "std_msgs/Header header;float32 angle_min;float32 angle_max;float32 angle_increment;float32 time_increment;\
         float32 scan_time;float32 range_min;float32 range_max;float32[] ranges;float32[] intensities",
    ),
    (
        "sensor_msgs/Imu",
        "std_msgs/Header header;geometry_msgs/Quaternion orientation;float64[9] orientation_covariance;\
         geometry_msgs/Vector3 angular_velocity;float64[9] angular_velocity_covariance;\
         geometry_msgs/Vector3 linear_acceleration;float64[9] linear_acceleration_covariance",
    ),
    ("sensor_msgs/CompressedImage", "std_msgs/Header header;string format;uint8[] data"),
    ("visualization_msgs/UVCoordinate", "float32 u;float32 v"),
    ("visualization_msgs/MeshFile", "string filename;uint8[] data"),
    (
        "visualization_msgs/Marker",
        "std_msgs/Header header;string ns;int32 id;int32 type;int32 action;geometry_msgs/Pose pose;\
         geometry_msgs/Vector3 scale;std_msgs/ColorRGBA color;builtin_interfaces/Duration lifetime;bool frame_locked;\
         geometry_msgs/Point[] points;std_msgs/ColorRGBA[] colors;string texture_resource;\
         sensor_msgs/CompressedImage texture;visualization_msgs/UVCoordinate[] uv_coordinates;string text;\
         string mesh_resource;visualization_msgs/MeshFile mesh_file;bool mesh_use_embedded_materials",
    ),
    ("visualization_msgs/MarkerArray", "visualization_msgs/Marker[] markers"),
    ("diagnostic_msgs/KeyValue", "string key;string value"),
    (
        "diagnostic_msgs/DiagnosticStatus",
        "byte OK=0;byte WARN=1;byte ERROR=2;byte STALE=3;byte level;string name;string message;string hardware_id;\
         diagnostic_msgs/KeyValue[] values",
    ),
    ("diagnostic_msgs/DiagnosticArray", "std_msgs/Header header;diagnostic_msgs/DiagnosticStatus[] status"),
];

/// What stands between a definition and those of the types in it.
const SEPARATOR: &str = "================================================================================";

fn fields(name: &str) -> Option<&'static str> {
    TYPES.iter().find(|(known, _)| *known == name).map(|(_, fields)| *fields)
}

/// The definition of a kind with those of all types in it, as `ros2msg` schemas have it.
#[must_use]
pub fn definition(kind: Kind) -> String {
    let mut names = vec![kind.name().replace("/msg/", "/")];
    let mut text = String::new();
    let mut next = 0;
    while let Some(name) = names.get(next).cloned() {
        if next > 0 {
            let _ = writeln!(text, "{SEPARATOR}\nMSG: {name}");
        }
        for field in fields(&name).unwrap_or_default().split(';') {
            let _ = writeln!(text, "{field}");
            let of = field.split([' ', '[']).next().unwrap_or_default();
            if fields(of).is_some() && !names.iter().any(|known| known == of) {
                names.push(of.to_owned());
            }
        }
        next += 1;
    }
    text
}

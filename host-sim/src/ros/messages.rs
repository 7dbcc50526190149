//! The messages themselves. Fields are named, ordered and measured as ROS 2 does: SI units, radians, quaternions.

use agv_core::geometry::Pose as PlanarPose;
use agv_core::measurement::Time;
use serde::{Deserialize, Serialize};

/// `builtin_interfaces/Time` and `Duration`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Stamp {
    /// Seconds.
    pub sec: i32,
    /// Nanoseconds.
    pub nanosec: u32,
}

impl Stamp {
    /// Nanoseconds.
    #[must_use]
    pub fn nanoseconds(self) -> i64 {
        i64::from(self.sec) * 1_000_000_000 + i64::from(self.nanosec)
    }
}

impl From<Time> for Stamp {
    fn from(time: Time) -> Self {
        let micros = time.micros();
        let sec = i32::try_from(micros / 1_000_000).unwrap_or(i32::MAX);
        Self { sec, nanosec: (micros % 1_000_000) as u32 * 1000 }
    }
}

/// `std_msgs/Header`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Header {
    /// When it was true.
    pub stamp: Stamp,
    /// In which frame.
    pub frame_id: String,
}

impl Header {
    /// A header.
    #[must_use]
    pub fn new(time: Time, frame: &str) -> Self {
        Self { stamp: time.into(), frame_id: frame.to_owned() }
    }
}

/// `geometry_msgs/Point` and `Vector3`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Vector {
    /// First component.
    pub x: f64,
    /// Second component.
    pub y: f64,
    /// Third component.
    pub z: f64,
}

/// `geometry_msgs/Quaternion`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Quaternion {
    /// First imaginary component.
    pub x: f64,
    /// Second imaginary component.
    pub y: f64,
    /// Third imaginary component.
    pub z: f64,
    /// Real component.
    pub w: f64,
}

impl Default for Quaternion {
    fn default() -> Self {
        Self { x: 0.0, y: 0.0, z: 0.0, w: 1.0 }
    }
}

/// `geometry_msgs/Pose` and `Transform`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// Position, m.
    pub position: Vector,
    /// Orientation.
    pub orientation: Quaternion,
}

impl Pose {
    /// Heading about the third axis, rad.
    #[must_use]
    pub fn heading(&self) -> f64 {
        let Quaternion { x, y, z, w } = self.orientation;
        (2.0 * (w * z + x * y)).atan2(1.0 - 2.0 * (y * y + z * z))
    }

    /// What of it lies in the plane.
    #[must_use]
    pub fn planar(&self) -> PlanarPose {
        PlanarPose::new(self.position.x, self.position.y, self.heading())
    }
}

impl From<PlanarPose> for Pose {
    fn from(pose: PlanarPose) -> Self {
        let (z, w) = (0.5 * pose.theta).sin_cos();
        Self { position: Vector { x: pose.x, y: pose.y, z: 0.0 }, orientation: Quaternion { x: 0.0, y: 0.0, z, w } }
    }
}

/// Covariance of x, y, z and the rotations about them, row by row; m and rad.
pub type Covariance = [[f64; 6]; 6];

/// The covariance of a planar pose: xx, xy, yy, x heading, y heading, heading.
#[must_use]
pub fn covariance([xx, xy, yy, xt, yt, tt]: [f64; 6]) -> Covariance {
    let mut all = Covariance::default();
    let entries =
        [(0, 0, xx), (0, 1, xy), (1, 0, xy), (1, 1, yy), (0, 5, xt), (5, 0, xt), (1, 5, yt), (5, 1, yt), (5, 5, tt)];
    for (row, column, value) in entries {
        all[row][column] = value;
    }
    all
}

/// `geometry_msgs/PoseWithCovariance`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PoseWithCovariance {
    /// The pose.
    pub pose: Pose,
    /// Its covariance.
    pub covariance: Covariance,
}

/// `geometry_msgs/PoseWithCovarianceStamped`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PoseWithCovarianceStamped {
    /// When and in which frame.
    pub header: Header,
    /// The pose.
    pub pose: PoseWithCovariance,
}

/// `geometry_msgs/PoseStamped`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PoseStamped {
    /// When and in which frame.
    pub header: Header,
    /// The pose.
    pub pose: Pose,
}

/// `geometry_msgs/Twist`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Twist {
    /// Speed, m/s.
    pub linear: Vector,
    /// Turning, rad/s.
    pub angular: Vector,
}

/// `geometry_msgs/TwistWithCovariance`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TwistWithCovariance {
    /// The motion.
    pub twist: Twist,
    /// Its covariance.
    pub covariance: Covariance,
}

/// `nav_msgs/Odometry`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Odometry {
    /// When, and in which frame the pose is.
    pub header: Header,
    /// In which frame the motion is.
    pub child_frame_id: String,
    /// Integrated pose.
    pub pose: PoseWithCovariance,
    /// Motion.
    pub twist: TwistWithCovariance,
}

/// `sensor_msgs/LaserScan`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LaserScan {
    /// When the first beam was measured, and in which frame.
    pub header: Header,
    /// Direction of the first beam, rad.
    pub angle_min: f32,
    /// Direction of the last beam, rad.
    pub angle_max: f32,
    /// Angle between neighbouring beams, rad.
    pub angle_increment: f32,
    /// Time between neighbouring beams, s.
    pub time_increment: f32,
    /// Time between scans, s.
    pub scan_time: f32,
    /// Smallest range that counts, m.
    pub range_min: f32,
    /// Largest range that counts, m.
    pub range_max: f32,
    /// Ranges, m.
    pub ranges: Vec<f32>,
    /// Strengths in the device's unit, or empty.
    pub intensities: Vec<f32>,
}

/// `sensor_msgs/PointField`: one number of each point.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct PointField {
    /// Its name.
    pub name: String,
    /// Its first byte in a point.
    pub offset: u32,
    /// Kind of number, 1 to 8: i8, u8, i16, u16, i32, u32, f32, f64.
    pub datatype: u8,
    /// Numbers of that kind.
    pub count: u32,
}

/// `sensor_msgs/PointCloud2`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct PointCloud2 {
    /// When it was measured, and in which frame.
    pub header: Header,
    /// Rows.
    pub height: u32,
    /// Points of a row.
    pub width: u32,
    /// What a point holds.
    pub fields: Vec<PointField>,
    /// Whether the highest byte comes first.
    pub is_bigendian: bool,
    /// Bytes of a point.
    pub point_step: u32,
    /// Bytes of a row.
    pub row_step: u32,
    /// The points.
    pub data: Vec<u8>,
    /// Whether all of them are seen.
    pub is_dense: bool,
}

/// `sensor_msgs/Imu`. The first entry of a covariance is -1 if what it is of is not measured.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Imu {
    /// When it was measured, and in which frame.
    pub header: Header,
    /// Orientation.
    pub orientation: Quaternion,
    /// Its covariance, rad^2.
    pub orientation_covariance: [f64; 9],
    /// Rates about the axes, rad/s.
    pub angular_velocity: Vector,
    /// Their covariance, rad^2/s^2.
    pub angular_velocity_covariance: [f64; 9],
    /// Acceleration, m/s^2.
    pub linear_acceleration: Vector,
    /// Its covariance, m^2/s^4.
    pub linear_acceleration_covariance: [f64; 9],
}

/// `geometry_msgs/TransformStamped`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TransformStamped {
    /// When, and the frame above.
    pub header: Header,
    /// The frame below.
    pub child_frame_id: String,
    /// Pose of the frame below in the one above.
    pub transform: Pose,
}

/// `tf2_msgs/TFMessage`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Transforms {
    /// The transforms.
    pub transforms: Vec<TransformStamped>,
}

/// `std_msgs/ColorRGBA`: shares of 0 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Colour {
    /// Red.
    pub r: f32,
    /// Green.
    pub g: f32,
    /// Blue.
    pub b: f32,
    /// Opacity.
    pub a: f32,
}

/// `sensor_msgs/CompressedImage`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CompressedImage {
    /// When and in which frame.
    pub header: Header,
    /// How it is compressed.
    pub format: String,
    /// The picture.
    pub data: Vec<u8>,
}

/// `visualization_msgs/MeshFile`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MeshFile {
    /// Name of the file.
    pub filename: String,
    /// What is in it.
    pub data: Vec<u8>,
}

/// What a marker looks like.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MarkerShape {
    /// An upright cylinder.
    Cylinder = 3,
    /// Cubes at all points.
    Cubes = 6,
    /// Balls at all points.
    Balls = 7,
    /// Points.
    Points = 8,
}

/// `visualization_msgs/Marker`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Marker {
    /// When and in which frame.
    pub header: Header,
    /// Group that the marker's number is unique in.
    pub ns: String,
    /// Its number.
    pub id: i32,
    /// Its shape.
    pub r#type: i32,
    /// 0: put it there.
    pub action: i32,
    /// Where.
    pub pose: Pose,
    /// How large, m.
    pub scale: Vector,
    /// Colour of all of it.
    pub color: Colour,
    /// How long; 0 is for ever.
    pub lifetime: Stamp,
    /// Whether it moves with its frame.
    pub frame_locked: bool,
    /// Points of a list.
    pub points: Vec<Vector>,
    /// Their colours, or empty.
    pub colors: Vec<Colour>,
    /// Name of a texture, or empty.
    pub texture_resource: String,
    /// The texture, or empty.
    pub texture: CompressedImage,
    /// Where the texture lies, or empty.
    pub uv_coordinates: Vec<[f32; 2]>,
    /// A text.
    pub text: String,
    /// Name of a mesh, or empty.
    pub mesh_resource: String,
    /// The mesh, or empty.
    pub mesh_file: MeshFile,
    /// Whether the mesh has its own colours.
    pub mesh_use_embedded_materials: bool,
}

/// `visualization_msgs/MarkerArray`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Markers {
    /// The markers.
    pub markers: Vec<Marker>,
}

/// `diagnostic_msgs/KeyValue`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct KeyValue {
    /// Name.
    pub key: String,
    /// Value.
    pub value: String,
}

/// How grave a diagnosis is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// All is well.
    #[default]
    Ok = 0,
    /// Somebody should look.
    Warning = 1,
    /// It does not work.
    Error = 2,
}

/// `diagnostic_msgs/DiagnosticStatus`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct DiagnosticStatus {
    /// A [`Level`].
    pub level: u8,
    /// Of what.
    pub name: String,
    /// What is the matter.
    pub message: String,
    /// Number of the device, or empty.
    pub hardware_id: String,
    /// Figures.
    pub values: Vec<KeyValue>,
}

/// `diagnostic_msgs/DiagnosticArray`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Diagnostics {
    /// When.
    pub header: Header,
    /// One for each part of the vehicle.
    pub status: Vec<DiagnosticStatus>,
}

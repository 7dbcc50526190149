//! What all of these commands are told about a sensor.

use std::net::IpAddr;
use std::path::PathBuf;

use agv_host_sim::lidar3d::SetupOptions;
use agv_lidar3d::geometry;
use agv_lidar3d::packet::{self, Tally};

/// What the source of a scan can be, for the help.
pub const SOURCES: &str = "\
A SOURCE is a capture (pcap or pcapng), a folder of range images (velodyne_config.txt and data/*.png), a point cloud (.pcd,
KITTI's .bin, .ply or .las) or a folder of them, a recording of ROS 2 with PointCloud2 (.mcap, .db3 or a folder of rosbag2, as
FILE#TOPIC where it has several), udp[:PORT] for a sensor that sends to this machine (port 2368 if none is stated), or
ws://HOST[:PORT][#TOPIC] for PointCloud2 of a running ROS 2 with foxglove_bridge (port 8765 if none is stated).

Sensors: Velodyne HDL-64E (db.xml or YAML), HDL-32E, VLP-16, VLP-32C, VLS-128; Hesai Pandar40P, PandarQT64, PandarXT32 (CSV of
its angles); Ouster (JSON of its metadata). A capture is read at the port of the first packet of a sensor.";

/// The sensor and its parameters.
#[derive(clap::Args, Clone)]
pub struct SensorArguments {
    /// Kind of sensor, where the packets do not state it.
    #[arg(long, value_name = "KIND")]
    sensor: Option<Sensor>,
    /// Calibration file: db.xml, YAML or CSV, and of an Ouster its JSON; without it that of the packets, or the maker's.
    #[arg(long, value_name = "FILE")]
    calibration: Option<PathBuf>,
    /// UDP port of a capture; without it that of the first packet of a sensor.
    #[arg(long, value_name = "PORT")]
    port: Option<u16>,
    /// Address from which the sensor of a capture sends; without it that of the first packet of a sensor.
    #[arg(long, value_name = "IP")]
    address: Option<IpAddr>,
    /// How the offsets of a beam are measured.
    #[arg(long, default_value = "orthogonal")]
    offsets: Offsets,
    /// Use the maker's two-point correction of near distances where the calibration states it.
    #[arg(long)]
    two_points: bool,
    /// Returns nearer than this are false, m; without it 0.9 of an HDL-64E, and what the others can see.
    #[arg(long, value_name = "M")]
    near: Option<f32>,
    /// Returns farther than this are false, m; without it 120 of an HDL-64E, and what the others can see.
    #[arg(long, value_name = "M")]
    far: Option<f32>,
}

#[derive(Clone, Copy, clap::ValueEnum)]
pub enum Sensor {
    /// 64 lasers, S1, S2 or S3.
    Hdl64e,
    /// 32 lasers.
    Hdl32e,
    /// 16 lasers.
    Vlp16,
    /// 32 lasers, 4 mm a count.
    Vlp32c,
    /// 128 lasers, Alpha Prime.
    Vls128,
}

#[derive(Clone, Copy, clap::ValueEnum)]
pub enum Offsets {
    /// At right angles to the beam.
    Orthogonal,
    /// The vertical one as a height above the plane of the sensor.
    Alternate,
}

impl From<Offsets> for geometry::Offsets {
    fn from(offsets: Offsets) -> Self {
        match offsets {
            Offsets::Orthogonal => Self::Orthogonal,
            Offsets::Alternate => Self::Alternate,
        }
    }
}

impl SensorArguments {
    /// What is stated.
    pub fn options(&self) -> SetupOptions {
        let sensor = self.sensor.map(|sensor| match sensor {
            Sensor::Hdl64e => packet::Sensor::Hdl64e,
            Sensor::Hdl32e => packet::Sensor::Hdl32e,
            Sensor::Vlp16 => packet::Sensor::Vlp16,
            Sensor::Vlp32c => packet::Sensor::Vlp32c,
            Sensor::Vls128 => packet::Sensor::Vls128,
        });
        SetupOptions {
            sensor,
            calibration: self.calibration.clone(),
            offsets: self.offsets.into(),
            two_points: self.two_points,
            port: self.port,
            address: self.address,
            near: self.near,
            far: self.far,
        }
    }
}

/// What became of the returns, as JSON.
pub fn tally_object(tally: Tally) -> serde_json::Value {
    serde_json::json!({
        "points": tally.points,
        "empty": tally.empty,
        "false_near": tally.near,
        "false_far": tally.far,
        "unused": tally.unused,
        "equal": tally.equal,
    })
}

/// What became of the returns, for people.
pub fn tally_rows(tally: Tally) -> Vec<[String; 2]> {
    let row = |name: &str, count: u64| [name.to_owned(), count.to_string()];
    let mut rows = vec![
        row("points", tally.points),
        row("nothing seen", tally.empty),
        row("false, too near", tally.near),
        row("false, too far", tally.far),
    ];
    if tally.unused > 0 {
        rows.push(row("of lasers not in use", tally.unused));
    }
    if tally.equal > 0 {
        rows.push(row("second returns that are the first", tally.equal));
    }
    rows
}

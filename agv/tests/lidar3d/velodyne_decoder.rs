//! Points of captures, as velodyne_decoder of M. Valgur computes them.

use std::path::Path;

use agv_host_sim::import::velodyne;
use agv_lidar3d::calibration::Calibration;
use agv_lidar3d::geometry::Offsets;
use agv_lidar3d::packet::{Decoder, Filter, Point, Sensor};
use agv_tests::{python, recordings, repository};

/// Greatest difference of a coordinate, m.
const TOLERANCE: f32 = 0.001;

/// x, y, z and intensity of each point. None if the package is not installed.
fn theirs(capture: &Path, model: &str, calibration: &Path) -> Option<Vec<[f32; 4]>> {
    let mut run = python("agreement with velodyne_decoder", "velodyne_decoder")?;
    run.arg(repository("host-sim/tests/lidar3d/velodyne_points.py")).arg(capture).arg(model).arg(calibration);
    let output = run.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let (points, rest) = output.stdout.as_chunks::<16>();
    assert!(rest.is_empty());
    let number = |bytes: &[u8; 16], at: usize| f32::from_le_bytes(std::array::from_fn(|byte| bytes[4 * at + byte]));
    Some(points.iter().map(|bytes| std::array::from_fn(|at| number(bytes, at))).collect())
}

fn ours(capture: &Path, sensor: Sensor, calibration: &Path) -> Vec<Point> {
    let calibration = Calibration::read(&std::fs::read_to_string(calibration).unwrap()).unwrap();
    let filter = Filter { near: 0.0, far: 1000.0 };
    let mut decoder = Decoder::new(sensor, &calibration.lasers, Offsets::Orthogonal, false, filter);
    let mut points = Vec::new();
    velodyne::for_each(capture, |_, packet| decoder.packet(packet, |point| points.push(point))).unwrap();
    points
}

fn agree(capture: &str, sensor: Sensor, model: &str, calibration: &str) -> Option<usize> {
    let test = "agreement with velodyne_decoder";
    let capture = recordings(test, &format!("lidar3d/pcap/{capture}"))?;
    let calibration = recordings(test, &format!("lidar3d/calib/{calibration}"))?;
    let theirs = theirs(&capture, model, &calibration)?;
    let ours = ours(&capture, sensor, &calibration);
    assert_eq!(ours.len(), theirs.len());
    for (number, (our, [x, y, z, intensity])) in ours.iter().zip(&theirs).enumerate() {
        let off = our.position.iter().zip([x, y, z]).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(off <= TOLERANCE, "point {number}: {our:?}, not {x} {y} {z}");
        assert_eq!(f32::from(our.intensity), *intensity, "point {number}");
    }
    Some(ours.len())
}

#[test]
fn hdl32e_points_are_the_same_within_a_millimetre() {
    let capture = "monterey-first-100-packets.pcap";
    if let Some(points) = agree(capture, Sensor::Hdl32e, "HDL32E", "ros_32db.yaml") {
        assert_eq!(points, 872_800);
    }
}

//! The mount of a lidar by a capture of its packets and the log of a drive, as people find it.

use std::f64::consts::FRAC_PI_2;
use std::path::Path;

use agv_core::geometry::Pose;
use agv_host_sim::export::velodyne::CaptureWriter;
use agv_host_sim::log;
use agv_host_sim::recording::truth_at;
use agv_host_sim::simulate::path::{Direction, Leg, PathSegment};
use agv_host_sim::simulate::random::{Random, Stream};
use agv_host_sim::simulate::scenario::{PathKind, PoseOptions, Scenario};
use agv_host_sim::simulate::storeys::Storeys;
use agv_host_sim::simulate::{simulate, standard};
use agv_lidar3d::calibration::Calibration;
use agv_lidar3d::packet::{Return, Sensor};
use nalgebra::{Rotation3, Vector3};
use serde_json::Value;

use super::vlp16::{FREQUENCY, PACKET, packet};
use crate::support::{Files, agv, refusal, text};

/// Where the sensor is on the vehicle, how high, and how it leans.
const MOUNT: Pose = Pose { x: 0.8, y: -0.25, theta: 0.6 };
const HEIGHT: f64 = 1.9;
const LEANING: [f64; 2] = [0.02, -0.03];
/// Standard deviation of a range, m.
const NOISE: f64 = 0.03;

/// A drive with bends both ways, from the end of the hall to where racks begin.
fn scenario() -> Scenario {
    let mut scenario = Scenario::parse(standard::HALL).unwrap();
    scenario.seed = 5;
    scenario.laser.scans = false;
    scenario.path.kind = PathKind::Legs;
    scenario.path.start = PoseOptions { x: 3.0, y: 10.0, heading_deg: 0.0 };
    let straight = PathSegment::straight;
    let bend = |sense: f64| PathSegment::arc(2.5, sense * FRAC_PI_2);
    let segments =
        vec![straight(2.0), bend(1.0), straight(1.0), bend(-1.0), straight(2.0), bend(-1.0), straight(1.0), bend(1.0)];
    scenario.path.legs = vec![Leg { direction: Direction::Forward, segments }];
    scenario
}

#[test]
fn a_capture_and_a_log_give_the_mount_within_its_deviations() {
    let files = Files::new();
    let scenario = scenario();
    let recording = simulate(&scenario).unwrap().recording;
    let (log_path, capture) = (files.path("drive.agvlog"), files.path("drive.pcap"));
    log::write(Path::new(&log_path), &recording).unwrap();
    let storeys = Storeys::of(&scenario);
    let lasers = Calibration::of_maker(Sensor::Vlp16).unwrap().lasers;
    let leaning = Rotation3::from_euler_angles(LEANING[0], LEANING[1], 0.0);
    let mut random = Random::new(5, Stream::MultiBeam);
    let first = recording.truth[0].time;
    let mut measured = |laser: usize, azimuth: f64, after: f64| {
        let nothing = Return { distance: 0, intensity: 0 };
        let Some(vehicle) = truth_at(&recording.truth, first.offset(after)) else { return nothing };
        let sensor = vehicle.compose(&MOUNT);
        // The beam leaves the axis as high as the maker's drawing says, and the sensor's distance counts from where it crosses the axis.
        let (sin, cos) = lasers[laser].elevation.sin_cos();
        let up = lasers[laser].vertical_offset;
        let along =
            |forward: f64, up: f64| leaning * Vector3::new(forward * azimuth.cos(), -forward * azimuth.sin(), up);
        let (origin, own) = (along(-up * sin, up * cos), along(cos, sin));
        let turned = Rotation3::from_axis_angle(&Vector3::z_axis(), sensor.theta);
        let (origin, direction) = (turned * origin, turned * own);
        let place = [sensor.x + origin.x, sensor.y + origin.y, HEIGHT + origin.z];
        let Some(hit) = storeys.first_hit(place, direction.into(), 100.0) else { return nothing };
        let distance = ((hit.distance - lasers[laser].distance + NOISE * random.normal()) / 0.002).round() as u16;
        Return { distance, intensity: 40 }
    };
    let mut writer = CaptureWriter::create(Path::new(&capture)).unwrap();
    let length = recording.truth.last().unwrap().time.since(first);
    for number in 0..(length / PACKET) as u32 {
        let start = PACKET * f64::from(number);
        let turn = (FREQUENCY * start) as u32;
        // Every fourth turn, whole.
        if !turn.is_multiple_of(4) || (FREQUENCY * (start + PACKET)) as u32 > turn {
            continue;
        }
        // The clock of the capture is three seconds behind that of the vehicle, and a packet comes when it is full.
        let time = first.offset(start + PACKET - 3.0);
        writer.packet(time, &packet(start, &mut measured)).unwrap();
    }
    writer.finish().unwrap();

    let mount = files.path("mount.json");
    let arguments = ["lidar3d", "mount", &capture, "--log", &log_path, "--shift", "3", "--height", "2.0", "-o", &mount];
    let output = agv(&[&arguments[..], &["--json"]].concat());
    assert!(output.status.success(), "{}", text(&output.stderr));
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(found, serde_json::from_slice::<Value>(&std::fs::read(&mount).unwrap()).unwrap());
    println!("{found:#}");
    for (key, truth, most) in [
        ("height_m", HEIGHT, 0.001),
        ("roll_deg", LEANING[0].to_degrees(), 0.005),
        ("pitch_deg", LEANING[1].to_degrees(), 0.005),
        ("yaw_deg", MOUNT.theta.to_degrees(), 0.3),
        ("x_m", MOUNT.x, 0.02),
        ("y_m", MOUNT.y, 0.02),
    ] {
        let (value, deviation) = (found[key]["value"].as_f64().unwrap(), found[key]["deviation"].as_f64().unwrap());
        assert!(
            (value - truth).abs() < 4.0 * deviation && deviation < most,
            "{key}: {value} +- {deviation}, not {truth}"
        );
    }

    // What it wrote is what the bridge reads.
    let refused = refusal(&["lidar3d", "bridge", &files.path("none.pcap"), "--mount", &mount]);
    assert!(refused.contains("none.pcap"), "{refused}");
}

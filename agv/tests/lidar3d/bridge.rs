//! The whole way of a multi-beam lidar that stands for a NAV350: its packets by UDP in, scans by TCP out.

use std::f64::consts::{PI, TAU};
use std::io::{BufRead, BufReader, Read};
use std::net::UdpSocket;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use agv_core::geometry::Pose;
use agv_core::localizer::Parameters;
use agv_core::measurement::Time;
use agv_core::odometry::Vehicle;
use agv_host_sim::link::clock::Clock;
use agv_host_sim::link::nav350::Link;
use agv_host_sim::live::{self, Limits, Recorder};
use agv_host_sim::log::{self, Writer};
use agv_host_sim::recording::{RecordedEvent, RecordedReflectors, RecordedScan};
use agv_lidar3d::calibration::{Calibration, Laser};
use agv_lidar3d::geometry::{Offsets, point};
use agv_lidar3d::packet::{Return, Sensor};
use agv_wire::nav350::Configuration;
use nalgebra::{Rotation3, Vector3};

use super::vlp16::{PACKET, packet};
use crate::support::Files;

/// Half of the length and of the width of a room, m; its floor and its ceiling below and above the sensor.
const ROOM: [f64; 2] = [6.0, 4.0];
const HEIGHT: f64 = 1.8;
const CEILING: f64 = 3.0;
/// Axis and radius of a reflector, m.
const REFLECTOR: [f64; 3] = [3.0, 1.5, 0.04];
/// How the sensor leans, rad.
const LEANING: [f64; 2] = [0.03, -0.02];
/// Speed of the sensor, m/s.
const SPEED: f64 = 1.0;
/// Where the sensor is, s after it began to send.
fn pose(time: f64) -> Pose {
    Pose::new(-4.5 + SPEED * time, -0.5, 0.0)
}

/// How far a level ray goes from a place to the walls and to the reflector, m.
fn to_surfaces(place: [f64; 2], [x, y]: [f64; 2]) -> [f64; 2] {
    let to_wall = |half: f64, place: f64, slope: f64| {
        if slope > 0.0 { (half - place) / slope } else { (-half - place) / slope }
    };
    let wall = to_wall(ROOM[0], place[0], x).min(to_wall(ROOM[1], place[1], y));
    let off = [REFLECTOR[0] - place[0], REFLECTOR[1] - place[1]];
    let (along, across) = (off[0] * x + off[1] * y, off[0] * y - off[1] * x);
    let depth = REFLECTOR[2] * REFLECTOR[2] - across * across;
    [wall, if depth > 0.0 && along > 0.0 { along - depth.sqrt() } else { f64::INFINITY }]
}

/// What a laser measures in the room, as a VLP-16 sends it.
fn measured(laser: &Laser, azimuth: f64, time: f64) -> Return {
    let leaning = Rotation3::from_euler_angles(LEANING[0], LEANING[1], 0.0);
    // A point is linear in its distance: two of them are the beam.
    let at = |distance: f64| leaning * Vector3::from(point(laser, Offsets::Orthogonal, azimuth, distance));
    let (origin, direction) = (at(0.0), at(1.0) - at(0.0));
    let level = direction.xy().norm();
    let sensor = pose(time);
    let [wall, reflector] =
        to_surfaces([sensor.x + origin.x, sensor.y + origin.y], [direction.x / level, direction.y / level])
            .map(|range| range / level);
    let flat = if direction.z > 0.0 { CEILING - origin.z } else { -HEIGHT - origin.z } / direction.z;
    let distance = wall.min(reflector).min(flat);
    let is_foil = distance == reflector;
    Return { distance: (distance / 0.002).round() as u16, intensity: if is_foil { 200 } else { 30 } }
}

/// A running `agv lidar3d bridge`.
struct Bridge {
    child: Child,
    notes: BufReader<std::process::ChildStderr>,
    udp: u16,
}

impl Bridge {
    fn start(arguments: &[&str]) -> Self {
        let udp = UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
        let source = format!("udp:{udp}");
        let mut child = Command::new(env!("CARGO_BIN_EXE_agv"))
            .args(["lidar3d", "bridge", &source, "--serve-port", "0"])
            .args(arguments)
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut notes = BufReader::new(child.stderr.take().unwrap());
        let mut line = String::new();
        notes.read_line(&mut line).unwrap();
        assert!(line.contains(&format!("waiting for a sensor on UDP port {udp}")), "{line}");
        Self { child, notes, udp }
    }

    /// Ctrl-C; what it has said since.
    fn interrupt(mut self) -> (Option<i32>, String) {
        let id = self.child.id().to_string();
        assert!(Command::new("kill").args(["-INT", &id]).status().unwrap().success());
        let mut said = String::new();
        self.notes.read_to_string(&mut said).unwrap();
        (self.child.wait().unwrap().code(), said)
    }
}

impl Drop for Bridge {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Sends packets at their times until `is_over`; the sensor begins at `begin`.
fn send(port: u16, begin: Instant, is_over: &AtomicBool) {
    let lasers = Calibration::of_maker(Sensor::Vlp16).unwrap().lasers;
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    for number in 0.. {
        if is_over.load(Ordering::Relaxed) {
            break;
        }
        let time = PACKET * f64::from(number);
        let bytes = packet(time, |laser, azimuth, at| measured(&lasers[laser], azimuth, at));
        let end = begin + Duration::from_secs_f64(time + PACKET);
        std::thread::sleep(end.saturating_duration_since(Instant::now()));
        socket.send_to(&bytes, ("127.0.0.1", port)).unwrap();
    }
}

/// Ends threads even if a test panics.
struct Over<'a>(&'a AtomicBool);

impl Drop for Over<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// What a controller reads of a bridge, as a recording does it: its events, and its clock at the beginning of the sensor, s.
fn heard(bridge: &mut Bridge, scans: usize, path: &Path) -> (Vec<RecordedEvent>, f64) {
    let is_over = AtomicBool::new(false);
    let clock = Clock::new(1.0);
    let begin = Instant::now();
    let at = clock.now().seconds();
    std::thread::scope(|scope| {
        let _over = Over(&is_over);
        let port = bridge.udp;
        let over = &is_over;
        scope.spawn(move || send(port, begin, over));
        let mut line = String::new();
        bridge.notes.read_line(&mut line).unwrap();
        assert!(line.contains("serving"), "{line}");
        let host = format!("127.0.0.1:{}", line.trim().rsplit(' ').next().unwrap());
        let recorder =
            Recorder::new(Writer::begin(path, &Parameters::new(Vehicle::Increments, Pose::default()), &[]).unwrap());
        let mut link = Link::new(&host, Configuration::default(), clock);
        let limits = Limits::until(Time::from_seconds(at + 20.0));
        live::record_nav350(&mut link, &limits, scans, &AtomicBool::new(false), &recorder).unwrap();
        recorder.finish().unwrap();
    });
    (log::read(path).unwrap().0.events, at)
}

/// Of a scan, how far each range is from that of the room, m: of walls that are no corners, without the reflector. `begin` is the clock at the
/// beginning of the sensor, s.
fn errors(scan: &RecordedScan, begin: f64) -> Vec<(f64, f64)> {
    let error = |(beam, range): (usize, &f32)| {
        let bearing = -PI + TAU * beam as f64 / 1440.0;
        let sensor = pose(scan.start.seconds() + scan.beam_interval * beam as f64 - begin);
        let expected = |side: f64| to_surfaces([sensor.x, sensor.y], [(bearing + side).cos(), (bearing + side).sin()]);
        let [wall, _] = expected(0.0);
        let is_corner = (expected(-0.04)[0] + expected(0.04)[0] - 2.0 * wall).abs() > 0.006 * wall;
        let hides = [-0.02, 0.0, 0.02].iter().any(|side| expected(*side)[1].is_finite());
        (!is_corner && !hides).then_some((bearing, f64::from(*range) - wall))
    };
    scan.ranges.iter().enumerate().filter_map(error).collect()
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

#[test]
fn packets_become_scans_of_the_room_at_the_times_of_its_beams() {
    let files = Files::new();
    let [roll, pitch] = LEANING.map(f64::to_degrees);
    let mount = format!(
        r#"{{"height_m": {{"value": {HEIGHT}}}, "roll_deg": {{"value": {roll}}}, "pitch_deg": {{"value": {pitch}}}}}"#
    );
    let mount = files.write("mount.json", mount.as_bytes());
    let mut bridge = Bridge::start(&["--mount", &mount, "--bright", "100"]);
    let (events, begin) = heard(&mut bridge, 24, Path::new(&files.path("bridge.agvlog")));
    let (code, said) = bridge.interrupt();
    // A busy machine may have left out some.
    assert!(code == Some(0) && (said.is_empty() || said.contains("revolutions were left out")), "{code:?} {said}");

    // The sensor was switched on while it moved, which takes some turns.
    let scans: Vec<&RecordedScan> = events
        .iter()
        .filter_map(|event| match event {
            RecordedEvent::Scan(scan) => Some(scan),
            _ => None,
        })
        .skip(6)
        .collect();
    assert!(scans.len() >= 15, "{}", scans.len());
    let mut lengths = Vec::new();
    let mut late = Vec::new();
    for scan in scans {
        let errors = errors(scan, begin);
        assert!(errors.len() > 1000, "{}", errors.len());
        lengths.push(median(errors.iter().map(|(_, error)| error.abs()).collect()));
        // What is told too late is too near ahead and too far behind.
        let ahead = errors.iter().filter(|(bearing, _)| bearing.cos().abs() > 0.9);
        late.push(median(ahead.map(|(bearing, error)| error * bearing.cos().signum() / SPEED).collect()));
    }
    let (length, late) = (median(lengths), median(late));
    println!("median {:.1} mm, times {:.1} ms", 1e3 * length, 1e3 * late);
    assert!(length < 0.006, "{length}");
    assert!(late.abs() < 0.006, "{late}");

    let mut seen = 0;
    for event in &events {
        let RecordedEvent::Reflectors(RecordedReflectors { observations, .. }) = event else { continue };
        for one in observations {
            let sensor = pose(one.time.seconds() - begin);
            let off = [REFLECTOR[0] - sensor.x, REFLECTOR[1] - sensor.y];
            let (sin, cos) = f64::from(one.bearing).sin_cos();
            let found = [f64::from(one.range) * cos, f64::from(one.range) * sin];
            seen += usize::from((found[0] - off[0]).hypot(found[1] - off[1]) < 0.05);
        }
    }
    assert!(seen >= 12, "{seen}");
}

#[test]
fn a_sensor_that_does_not_send_is_told() {
    let (code, said) = Bridge::start(&["--height", "1.8"]).interrupt();
    assert_eq!(code, Some(1));
    assert!(said.contains("nothing was received on UDP port"), "{said}");
}

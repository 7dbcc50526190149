//! Clouds as scans of a planar laser, and the sensor that serves them.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use std::f64::consts::{PI, TAU};

use agv_core::geometry::Pose;
use agv_core::measurement::Time;
use agv_host_sim::lidar3d::Revolution;
use agv_host_sim::lidar3d::cloud_speed::CloudSpeed;
use agv_host_sim::lidar3d::projection::{Projection, Speed};
use agv_host_sim::lidar3d::spinning_lidar::SpinningLidar;
use agv_host_sim::recording::Truth;
use agv_host_sim::serve::nav350::{Connection, Drive, Sensor, SensorClockOptions, Turn};
use agv_host_sim::simulate::random::{Random, Stream};
use agv_host_sim::simulate::scenario::Scenario;
use agv_host_sim::simulate::storeys::Storeys;
use agv_wire::nav350::SensorFrame;
use nalgebra::Rotation3;

/// A room from (-6, -4) to (6, 4), with a reflector at (3, 1).
const ROOM: &str = "
[world]
kind = \"shapes\"
walls = [[-6.0, -4.0, 6.0, -4.0], [6.0, -4.0, 6.0, 4.0], [6.0, 4.0, -6.0, 4.0], [-6.0, 4.0, -6.0, -4.0]]
reflectors = [{ x = 3.0, y = 1.0 }]
";

fn room() -> Storeys {
    Storeys::of(&Scenario::parse(ROOM).unwrap())
}

fn lidar() -> SpinningLidar {
    SpinningLidar { noise: 0.0, mount: Pose::default(), roll: 0.03, pitch: -0.02, ..SpinningLidar::vlp16() }
}

fn projection(lidar: &SpinningLidar) -> Projection {
    Projection {
        levelling: Rotation3::from_euler_angles(lidar.roll, lidar.pitch, 0.0),
        height: lidar.height,
        bright: Some(100),
        frame: SensorFrame::default(),
    }
}

/// A vehicle that drives an arc for two seconds.
fn arc(speed: Speed) -> (Vec<Truth>, impl Fn(f64) -> Pose) {
    let pose = move |time: f64| {
        let turn = speed.turn * time;
        if turn.abs() < 1e-12 {
            return Pose::new(-2.0 + speed.x * time, speed.y * time, 0.0);
        }
        let (sin, cos) = turn.sin_cos();
        let (along, across) = (sin / speed.turn, (1.0 - cos) / speed.turn);
        Pose::new(-2.0 + speed.x * along - speed.y * across, speed.x * across + speed.y * along, turn)
    };
    let truth = (0..=2000).map(|step| {
        let time = 1e-3 * f64::from(step);
        Truth { time: Time::from_seconds(1.0 + time), pose: pose(time) }
    });
    (truth.collect(), pose)
}

fn revolution(lidar: &SpinningLidar, truth: &[Truth], time: f64) -> Revolution {
    let mut random = Random::new(1, Stream::MultiBeam);
    lidar.revolution(&room(), truth, Time::from_seconds(1.0 + time), &mut random).unwrap()
}

/// Range from a pose to the walls of the room in a direction of the pose.
fn range(pose: &Pose, bearing: f64) -> f64 {
    let (sin, cos) = (pose.theta + bearing).sin_cos();
    let to = |position: f64, slope: f64, half: f64| {
        if slope > 0.0 { (half - position) / slope } else { (-half - position) / slope }
    };
    to(pose.x, cos, 6.0).min(to(pose.y, sin, 4.0))
}

#[test]
fn every_beam_is_as_seen_at_its_own_time() {
    let lidar = lidar();
    for speed in [Speed::default(), Speed { x: 1.2, y: 0.0, turn: 0.0 }, Speed { x: 1.0, y: 0.3, turn: 0.5 }] {
        let (truth, pose) = arc(speed);
        let scan = projection(&lidar).project(&revolution(&lidar, &truth, 0.5), speed).scan;
        let mut worst = 0.0_f64;
        let mut compared = 0;
        for (beam, seen) in scan.ranges.iter().enumerate() {
            let time = scan.start.offset(scan.beam_interval * beam as f64).since(Time::from_seconds(1.0));
            let (bearing, at) = (-PI + TAU * beam as f64 / 1440.0, pose(time));
            // The reflector stands before the wall, and corners are no line.
            let edge = [-0.03, 0.03].map(|side| range(&at, bearing + side));
            let is_corner = (edge[0] + edge[1] - 2.0 * range(&at, bearing)).abs() > 0.004 * range(&at, bearing);
            let to_reflector = ((1.0 - at.y).atan2(3.0 - at.x) - at.theta - bearing).abs();
            if *seen == 0.0 || is_corner || to_reflector < 0.06 {
                continue;
            }
            compared += 1;
            worst = worst.max((f64::from(*seen) - range(&at, bearing)).abs());
        }
        println!("{speed:?}: {compared} beams, worst {:.2} mm", 1e3 * worst);
        assert!(compared > 1200 && worst < 0.003, "{compared} {worst}");
    }
}

#[test]
fn surfaces_have_less_noise_than_beams_and_corners_stay() {
    let lidar = SpinningLidar { noise: 0.03, ..lidar() };
    let (truth, pose) = arc(Speed::default());
    let at = pose(0.5);
    let mut random = Random::new(1, Stream::MultiBeam);
    let (mut walls, mut corners) = (Vec::new(), Vec::new());
    for number in 0..5 {
        let start = Time::from_seconds(1.0 + 0.1 * f64::from(number));
        let revolution = lidar.revolution(&room(), &truth, start, &mut random).unwrap();
        let scan = projection(&lidar).project(&revolution, Speed::default()).scan;
        for (beam, seen) in scan.ranges.iter().enumerate().filter(|(_, seen)| **seen > 0.0) {
            let bearing = -PI + TAU * beam as f64 / 1440.0;
            let to_reflector = ((1.0 - at.y).atan2(3.0 - at.x) - at.theta - bearing).abs();
            let to_corner = [(6.0, 4.0), (-6.0, 4.0), (-6.0, -4.0), (6.0, -4.0_f64)]
                .map(|(x, y)| agv_core::geometry::difference((y - at.y).atan2(x - at.x), bearing).abs())
                .into_iter()
                .fold(f64::INFINITY, f64::min);
            let error = f64::from(*seen) - range(&at, bearing);
            // A beam along an axis never meets the walls beside it.
            match (to_reflector > 0.06 && error.is_finite(), to_corner < 0.03) {
                (true, true) => corners.push(error),
                (true, false) => walls.push(error),
                _ => {}
            }
        }
    }
    let mean = |errors: &[f64]| errors.iter().sum::<f64>() / errors.len() as f64;
    let root = |errors: &[f64]| (errors.iter().map(|error| error * error).sum::<f64>() / errors.len() as f64).sqrt();
    println!("walls {:.1} mm, mean {:.2}; corners {:.1}", 1e3 * root(&walls), 1e3 * mean(&walls), 1e3 * root(&corners));
    // Without it a beam of two to four rings has 15 to 21 mm.
    assert!(walls.len() > 6000 && root(&walls) < 0.011 && mean(&walls).abs() < 0.001);
    assert!(corners.len() > 200 && root(&corners) < 0.025);
}

#[test]
fn a_bright_return_is_a_reflector() {
    let lidar = lidar();
    let (truth, _) = arc(Speed::default());
    let seen = projection(&lidar).project(&revolution(&lidar, &truth, 0.5), Speed::default());
    let [one] = seen.reflectors.observations.as_slice() else { panic!("{:?}", seen.reflectors) };
    let expected = (5.0_f64.hypot(1.0), 1.0_f64.atan2(5.0));
    assert!((f64::from(one.range) - expected.0).abs() < 0.02, "{one:?}");
    assert!((f64::from(one.bearing) - expected.1).abs() < 0.004, "{one:?}");
}

#[test]
fn clouds_tell_how_fast_the_sensor_moves() {
    let lidar = SpinningLidar { noise: 0.03, ..lidar() };
    let told = Speed { x: 1.0, y: 0.3, turn: 0.5 };
    let (truth, _) = arc(told);
    let mut random = Random::new(1, Stream::MultiBeam);
    let mut clouds = CloudSpeed::new(projection(&lidar).levelling, lidar.height);
    let mut speed = Speed::default();
    for number in 0..15 {
        let start = Time::from_seconds(1.0 + 0.1 * f64::from(number));
        speed = clouds.speed(&lidar.revolution(&room(), &truth, start, &mut random).unwrap());
    }
    assert!((speed.x - told.x).abs() < 0.05 && (speed.y - told.y).abs() < 0.05, "{speed:?}");
    assert!((speed.turn - told.turn).abs() < 0.02, "{speed:?}");
}

#[test]
fn speeds_are_those_of_the_middle_of_a_turn_while_they_change() {
    let lidar = SpinningLidar { noise: 0.03, ..lidar() };
    // Drives off at 0.5 m/s^2, and after a second steers into a bend within another one.
    let told = |time: f64| Speed { x: 0.5 * time.min(2.4), y: 0.0, turn: 0.6 * (time - 1.0).clamp(0.0, 1.0) };
    let mut pose = Pose::new(-3.0, -1.0, 0.0);
    let mut truth = Vec::new();
    for step in 0..=3000 {
        let time = 1e-3 * f64::from(step);
        truth.push(Truth { time: Time::from_seconds(1.0 + time), pose });
        let speed = told(time + 0.5e-3);
        pose = pose.compose(&Pose::new(1e-3 * speed.x, 0.0, 1e-3 * speed.turn));
    }
    let mut random = Random::new(1, Stream::MultiBeam);
    let mut clouds = CloudSpeed::new(projection(&lidar).levelling, lidar.height);
    let (mut way, mut turn) = (0.0_f64, 0.0_f64);
    for number in 0..28 {
        let after = 0.1 * f64::from(number);
        let start = Time::from_seconds(1.0 + after);
        let found = clouds.speed(&lidar.revolution(&room(), &truth, start, &mut random).unwrap());
        let told = told(after + 0.05);
        if number > 1 {
            way = way.max((found.x - told.x).hypot(found.y - told.y));
            turn = turn.max((found.turn - told.turn).abs());
        }
    }
    println!("worst {way:.3} m/s, {turn:.4} rad/s");
    assert!(way < 0.06 && turn < 0.05, "{way} {turn}");
}

#[test]
fn a_live_sensor_answers_when_a_turn_has_ended() {
    let frame = SensorFrame::default();
    let mut sensor = Sensor::new(Drive::live(frame), SensorClockOptions::default(), None, false);
    let mut connection = Connection::default();
    let ask = |connection: &mut Connection, sensor: &mut Sensor, text: &str, now: f64| {
        let bytes = [b"\x02".as_slice(), text.as_bytes(), b"\x03"].concat();
        String::from_utf8_lossy(&connection.receive(sensor, &bytes, now)).into_owned()
    };
    ask(&mut connection, &mut sensor, "sMN SetAccessMode 3 F4724744", 0.1);
    ask(&mut connection, &mut sensor, "sMN mNEVAChangeState 4", 0.2);
    let accepted = ask(&mut connection, &mut sensor, "sMN mNPOSGetData 1 2", 0.3);
    assert!(accepted.contains("sMA mNPOSGetData"), "{accepted}");
    assert_eq!(connection.poll(&sensor, 5.0), None);
    let lidar = lidar();
    let (truth, _) = arc(Speed::default());
    let seen = projection(&lidar).project(&revolution(&lidar, &truth, 0.5), Speed::default());
    for _ in 0..10 {
        sensor.see(Turn::of(&seen.scan, &frame));
    }
    let answer = connection.poll(&sensor, 5.1).unwrap();
    assert!(String::from_utf8_lossy(&answer).contains("sAN mNPOSGetData"));
    assert_eq!(connection.poll(&sensor, 5.2), None);
}

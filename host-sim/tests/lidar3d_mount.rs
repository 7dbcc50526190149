//! Where a multi-beam lidar is on its vehicle, found in halls that are cast ray by ray.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use std::f64::consts::FRAC_PI_2;

use agv_core::geometry::{Pose, difference};
use agv_host_sim::lidar3d::mount::{Mount, MountFinder};
use agv_host_sim::lidar3d::spinning_lidar::SpinningLidar;
use agv_host_sim::recording::Truth;
use agv_host_sim::simulate::path::{Direction, Leg, Path, PathSegment};
use agv_host_sim::simulate::random::{Random, Stream};
use agv_host_sim::simulate::scenario::{PathKind, PoseOptions, Scenario};
use agv_host_sim::simulate::storeys::Storeys;
use agv_host_sim::simulate::{START, simulate};
use agv_lidar3d::cloud::RingOrder;
use agv_lidar3d::mount::Known;

/// Into an aisle, out of it and round a corner: bends both ways.
fn bends() -> Vec<PathSegment> {
    let straight = PathSegment::straight;
    vec![
        straight(2.0),
        PathSegment::arc(2.5, FRAC_PI_2),
        straight(1.0),
        PathSegment::arc(2.5, -FRAC_PI_2),
        straight(2.0),
        PathSegment::arc(2.5, -FRAC_PI_2),
        straight(1.0),
        PathSegment::arc(2.5, FRAC_PI_2),
        straight(2.0),
    ]
}

fn drive(start: PoseOptions, segments: Vec<PathSegment>, seed: u64) -> (Storeys, Vec<Truth>) {
    let mut scenario = Scenario::parse(agv_host_sim::simulate::standard::HALL).unwrap();
    scenario.seed = seed;
    scenario.laser.scans = false;
    scenario.path.kind = PathKind::Legs;
    scenario.path.start = start;
    let path = Path { start: start.pose(), legs: vec![Leg { direction: Direction::Forward, segments }] };
    scenario.path.legs = path.legs;
    (Storeys::of(&scenario), simulate(&scenario).unwrap().recording.truth)
}

/// From the end of the hall, where racks begin.
const BEFORE_RACKS: PoseOptions = PoseOptions { x: 3.0, y: 10.0, heading_deg: 0.0 };

fn sensor(noise: f64) -> SpinningLidar {
    SpinningLidar {
        columns: 450,
        noise,
        mount: Pose::new(0.8, -0.25, 0.6),
        height: 1.9,
        roll: 0.02,
        pitch: -0.03,
        ..SpinningLidar::vlp16()
    }
}

/// An odometry with errors of the way and of the turn that are independent from step to step.
fn odometry(truth: &[Truth], way: f64, turn: f64, random: &mut Random) -> Vec<Truth> {
    let mut pose = Pose::new(0.0, 0.0, 0.0);
    let mut told = vec![Truth { time: truth[0].time, pose }];
    for pair in truth.windows(2) {
        let step = pair[0].pose.between(&pair[1].pose);
        let root = step.x.hypot(step.y).sqrt();
        let (long, slip) = (way * root * random.normal(), turn * root * random.normal());
        pose = pose.compose(&Pose::new(step.x + long, step.y, step.theta + slip));
        told.push(Truth { time: pair[1].time, pose });
    }
    told
}

fn found(
    sensor: &SpinningLidar,
    storeys: &Storeys,
    truth: &[Truth],
    odometry: &[Truth],
    height: Option<f64>,
    seed: u64,
) -> Mount {
    let mut random = Random::new(seed, Stream::MultiBeam);
    let mut finder = MountFinder::new(RingOrder::new(&sensor.lasers()), odometry, height);
    for turn in (0..).step_by(4) {
        let start = START.offset(f64::from(turn) / sensor.frequency);
        let Some(revolution) = sensor.revolution(storeys, truth, start, &mut random) else { break };
        finder.add(&revolution, start);
    }
    finder.find()
}

#[test]
fn without_noise_the_mount_is_found_exactly() {
    let (storeys, truth) = drive(BEFORE_RACKS, bends(), 7);
    let sensor = sensor(0.0);
    let mount = found(&sensor, &storeys, &truth, &truth, None, 7);
    println!("{mount:?}");
    let (attitude, drive) = (mount.attitude.unwrap(), mount.drive.unwrap());
    assert!((attitude.height - 1.9).abs() < 2e-4, "{attitude:?}");
    assert!((attitude.roll - 0.02).abs() < 2e-5 && (attitude.pitch + 0.03).abs() < 2e-5, "{attitude:?}");
    let value = |known: Option<Known>| known.unwrap().value;
    assert!((value(drive.x) - 0.8).abs() < 1e-3 && (value(drive.y) + 0.25).abs() < 1e-3, "{drive:?}");
    assert!(difference(value(drive.yaw), 0.6).abs() < 2e-4 && (value(drive.scale) - 1.0).abs() < 2e-4, "{drive:?}");
}

#[test]
fn a_straight_drive_leaves_the_place_open() {
    let (storeys, truth) = drive(BEFORE_RACKS, vec![PathSegment::straight(9.0)], 7);
    let mount = found(&sensor(0.02), &storeys, &truth, &truth, Some(1.9), 7);
    let drive = mount.drive.unwrap();
    println!("{drive:?}");
    assert!(drive.x.is_none() && drive.y.is_none());
    assert!(difference(drive.yaw.unwrap().value, 0.6).abs() < 0.01 && drive.scale.is_some());
}

/// `AGV_MOUNT_SEEDS=50` makes the whole table.
#[test]
fn the_spread_is_what_is_stated() {
    let seeds = std::env::var("AGV_MOUNT_SEEDS").ok().map_or(12, |seeds| seeds.parse().unwrap());
    let mut errors: [Vec<(f64, f64)>; 7] = std::array::from_fn(|_| Vec::new());
    let names = ["height, mm", "roll, deg", "pitch, deg", "yaw, deg", "x, mm", "y, mm", "scale, %"];
    let units =
        [1e3, 180.0 / std::f64::consts::PI, 180.0 / std::f64::consts::PI, 180.0 / std::f64::consts::PI, 1e3, 1e3, 1e2];
    for seed in 100_000..100_000 + seeds {
        let (storeys, truth) = drive(BEFORE_RACKS, bends(), seed);
        let mut random = Random::new(seed, Stream::Odometry);
        let odometry = odometry(&truth, 0.003, 0.001, &mut random);
        let mount = found(&sensor(0.03), &storeys, &truth, &odometry, Some(2.0), seed);
        let (attitude, drive) = (mount.attitude.unwrap(), mount.drive.unwrap());
        let by_floor = [attitude.height - 1.9, attitude.roll - 0.02, attitude.pitch + 0.03];
        let known = [drive.yaw, drive.x, drive.y, drive.scale].map(Option::unwrap);
        for (at, (error, deviation)) in by_floor.into_iter().zip(attitude.deviations).enumerate() {
            errors[at].push((error, deviation));
        }
        for (at, (known, truth)) in known.into_iter().zip([0.6, 0.8, -0.25, 1.0]).enumerate() {
            errors[3 + at].push((known.value - truth, known.deviation));
        }
    }
    let root = |values: &[(f64, f64)], value: fn(&(f64, f64)) -> f64| {
        (values.iter().map(|pair| value(pair).powi(2)).sum::<f64>() / values.len() as f64).sqrt()
    };
    let mut wrong = Vec::new();
    for ((name, unit), errors) in names.iter().zip(units).zip(&errors) {
        let (spread, stated) = (root(errors, |pair| pair.0), root(errors, |pair| pair.1));
        let worst = errors.iter().map(|pair| pair.0.abs()).fold(0.0, f64::max);
        println!("{name}: spread {:.4}, stated {:.4}, worst {:.4}", unit * spread, unit * stated, unit * worst);
        if !(0.5..2.0).contains(&(spread / stated)) {
            wrong.push(name);
        }
    }
    assert!(wrong.is_empty(), "{wrong:?}");
}

#[test]
fn the_height_in_an_aisle_is_that_of_the_floor() {
    let aisle = PoseOptions { x: 20.0, y: 12.0, heading_deg: 0.0 };
    let (storeys, truth) = drive(aisle, vec![PathSegment::straight(6.0)], 3);
    for height in [None, Some(1.8)] {
        let mount = found(&sensor(0.02), &storeys, &truth, &truth, height, 3);
        let attitude = mount.attitude.unwrap();
        assert!((attitude.height - 1.9).abs() < 0.01, "{height:?} {attitude:?}");
    }
}

//! The vehicle's own filter by the contours of the way behind: simulated drives whose truth is kept apart.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "a panic is how a test fails")]

use std::f64::consts::{PI, TAU};

use agv_core::geometry::{Pose, Twist, difference};
use agv_core::localizer::{CapacitiesOf, Event, Localizer, Mode, Parameters, PoseFix, PoseOutput, SlamSlots};
use agv_core::measurement::{PoseIncrement, Time};
use agv_core::odometry::Vehicle;
use agv_core::sources::Contours;
use nalgebra::{Matrix3, Vector3};

use super::support::standing_scan;
use super::support::walls::{Noise, Walls, corridor, range, room};

const BEAMS: usize = 360;
type Small = Localizer<CapacitiesOf<BEAMS, 16, 16, 4, SlamSlots, Contours<'static, 400, 4096, 20>>>;

const LASER: Pose = Pose { x: 0.4, y: 0.05, theta: 0.2 };

/// Time between two reports of the odometry, each of which has a scan, us.
const INTERVAL: u64 = 100_000;

/// Random walk of the way, m for a root of a metre, and of the heading, rad for one.
const WALK: f64 = 0.01;

struct Drive {
    localizer: Box<Small>,
    walls: Walls,
    truth: Pose,
    reports: u64,
    noise: Noise,
}

impl Drive {
    fn new(walls: Walls, has_contours: bool, seed: u64) -> Self {
        let mut parameters = Parameters::new(Vehicle::Increments, LASER);
        let noise = &mut parameters.odometry_noise;
        (noise.slip, noise.side_slip, noise.yaw) = (WALK, WALK, WALK);
        let biases = &mut parameters.slam.biases;
        (biases.scale, biases.steering, biases.laser_yaw) = (1e-9, 1e-9, 1e-9);
        parameters.slam.bias_walk = agv_core::filter::BiasWalk::NONE;
        parameters.maps.slam = true;
        parameters.sources.contours = has_contours;
        parameters.sources.key_scans = false;
        (parameters.sources.corners, parameters.sources.end_points) = (false, false);
        let localizer = Box::new(Small::new(parameters));
        let truth = Pose::new(0.0, 0.1, 0.05);
        let mut drive = Self { localizer, walls, truth, reports: 0, noise: Noise(seed) };
        drive.report(&Pose::default());
        let fix = PoseFix { time: drive.time(), pose: truth, position_deviation: 1e-4, heading_deviation: 1e-5 };
        drive.localizer.handle(&Event::SetPose(fix));
        drive.scan();
        drive
    }

    fn time(&self) -> Time {
        Time::from_micros(1_000_000 + self.reports * INTERVAL)
    }

    fn report(&mut self, displacement: &Pose) {
        let increment = PoseIncrement { time: self.time(), displacement: *displacement };
        self.localizer.handle(&Event::Increment(increment));
    }

    /// A scan that takes no time.
    fn scan(&mut self) {
        let at = self.truth.compose(&LASER);
        let of = |beam: usize| Pose { theta: at.theta + beam as f64 * TAU / BEAMS as f64 - PI, ..at };
        let ranges: Vec<f32> = (0..BEAMS).map(|beam| range(&self.walls, &of(beam), &mut self.noise)).collect();
        self.localizer.handle(&Event::Scan(standing_scan::scan(self.time(), &ranges)));
    }

    /// Goes on for a step; what is reported has the noise that the vehicle believes, and is longer by a share.
    fn go(&mut self, twist: &Twist, scale: f64) -> PoseOutput {
        let step = Pose::exp(twist);
        self.reports += 1;
        self.truth = self.truth.compose(&step);
        let root = WALK * step.x.abs().sqrt();
        let mut noise = || root * self.noise.normal();
        let reported = Pose::new(scale * step.x + noise(), step.y + noise(), step.theta + noise());
        self.report(&reported);
        self.scan();
        self.said()
    }

    fn said(&self) -> PoseOutput {
        self.localizer.outputs().pose
    }

    /// Squared error by the covariance that the vehicle states.
    fn normalised_square(&self) -> f64 {
        let PoseOutput { pose, covariance: [xx, xy, yy, xh, yh, hh], .. } = self.said();
        let error = pose.position() - self.truth.position();
        let error = Vector3::new(error.x, error.y, difference(pose.theta, self.truth.theta));
        let covariance = Matrix3::new(xx, xy, xh, xy, yy, yh, xh, yh, hh);
        error.dot(&(covariance.try_inverse().unwrap() * error))
    }
}

const AHEAD: Twist = Twist { x: 0.06, y: 0.0, theta: 0.0 };

/// Rounds in the middle of the room.
fn round(drive: &mut Drive, steps: usize, scale: f64) -> PoseOutput {
    (0..steps).map(|_| drive.go(&Twist { theta: 0.03, ..AHEAD }, scale)).last().unwrap()
}

#[test]
fn a_room_keeps_the_pose_though_the_wheels_are_wrong() {
    let mut drive = Drive::new(room(), true, 7);
    let said = round(&mut drive, 300, 1.1);
    let error = (said.pose.position() - drive.truth.position()).norm();
    let turn = difference(said.pose.theta, drive.truth.theta).abs();
    assert!(error < 0.02 && turn < 0.004, "{error} {turn}");
    assert_eq!(said.mode, Mode::Features, "{:?}", said.reason);
    let mut blind = Drive::new(room(), false, 7);
    let said = round(&mut blind, 300, 1.1);
    assert!((said.pose.position() - blind.truth.position()).norm() > 0.2, "the wheels alone are as good");
}

#[test]
fn a_heading_that_is_wrong_by_far_more_than_believed_is_found() {
    let mut drive = Drive::new(room(), true, 11);
    round(&mut drive, 40, 1.0);
    // The wheels have not noticed the turn.
    drive.truth.theta += 0.4;
    let said = round(&mut drive, 5, 1.0);
    let turn = difference(said.pose.theta, drive.truth.theta).abs();
    assert!(turn < 0.01 && said.mode != Mode::Lost, "{turn} {:?}", said.reason);
}

#[test]
fn along_a_plain_corridor_the_pose_is_as_unsure_as_by_the_wheels_alone() {
    let along = |has_contours: bool| {
        let mut drive = Drive::new(corridor(None), has_contours, 3);
        (0..200).for_each(|_| _ = drive.go(&AHEAD, 1.0));
        // The heading was 0.05 rad all the way, so the wall comes near: the corridor is 2.4 m wide.
        (drive.said().covariance, drive.said().pose.position() - drive.truth.position())
    };
    let (by_contours, error) = along(true);
    let (by_wheels, _) = along(false);
    let ratio = by_contours[0] / by_wheels[0];
    assert!((0.8..1.3).contains(&ratio), "{by_contours:?} {by_wheels:?}");
    assert!(by_contours[2] < 0.01 * by_wheels[2] && by_contours[5] < 0.01 * by_wheels[5], "{by_contours:?}");
    assert!(error.y.abs() < 0.03, "{error}");
}

#[test]
fn the_covariance_is_that_of_the_errors() {
    let runs = 16;
    let sum: f64 = (0..runs)
        .map(|seed| {
            let mut drive = Drive::new(room(), true, 100 + seed);
            round(&mut drive, 100, 1.0);
            drive.normalised_square()
        })
        .sum();
    let mean = sum / runs as f64;
    // Chi-square with three degrees of freedom: three.
    assert!((1.0..5.0).contains(&mean), "{mean}");
}

#[test]
fn submap_look_up_and_key_scans_take_at_most_160_kib() {
    assert!(size_of::<Contours>() <= 160 * 1024, "{}", size_of::<Contours>());
    // Without key scans: for a vehicle that has no past poses in its state.
    let without = size_of::<Contours<'static, 400, 6144, 0>>();
    assert!(size_of::<Contours>() - without < 50 * 1024, "{without}");
}

//! Which calibration drive to make (K 5.2.1): the one that promises the smallest deviations in the area and the time that
//! there are.

use agv_core::geometry::{Point, Pose, Twist};
use agv_core::measurement::Time;
use agv_core::odometry::Tricycle;
use nalgebra::Matrix3;
use serde::Serialize;
use thiserror::Error;

use super::design::{Design, Order, PlannedSegment, path};
use super::joint::{FitError, Free, expected_deviations};
use super::model::{PARAMETERS, VehicleModel};
use super::noise::NoiseModel;
use super::reflector_noise::{MeanPoint, ReflectorNoise, weighted_motion};
use super::window::{Step, Window};
use crate::simulate::path::Path;
use crate::simulate::scenario::{
    DriveOptions, LaserOptions, OdometryOptions, PathKind, PathOptions, PoseOptions, ReflectorShape, Scenario, Shapes,
    StartOptions, VehicleOptions, WorldOptions,
};
use crate::simulate::speed_profile::SpeedProfile;

/// What there is for a calibration drive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Means {
    /// The vehicle as it is believed to be, and its laser.
    pub vehicle: VehicleModel,
    /// Free area, m: its two sides.
    pub area: [f64; 2],
    /// Distance that the logical point must keep from its border, m.
    pub clearance: f64,
    /// Smallest and largest steering angle, rad.
    pub steering: [f64; 2],
    /// Longest duration, s.
    pub time: f64,
    /// Speed of the driving wheel, m/s.
    pub speed: f64,
}

/// A planned drive.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// Its arcs.
    pub design: Design,
    /// In the order in which they are driven.
    pub segments: Vec<PlannedSegment>,
    /// Corners of the rectangle that the logical point stays in, in R at the start, m.
    pub bounds: [Point; 2],
    /// Duration, s.
    pub duration: f64,
    /// Expected standard deviations in the order of [`VehicleModel::vector`]; zero for what is held.
    pub deviations: [f64; PARAMETERS],
}

/// Why there is no plan.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq, Serialize)]
pub enum PlanError {
    /// No arc fits.
    #[error("no calibration drive fits into this area: steer more, or find a larger one")]
    TooSmall,
    /// There is too little time.
    #[error("no calibration drive that fits into this area is done in this time")]
    TooShort,
    /// What fits does not tell the parameters.
    #[error("the drives that fit do not tell the parameters: a larger range of steering angles is needed")]
    NotObservable,
}

/// Revolutions at each stop, and how often the laser turns a second.
const SCANS: f64 = 64.0;
const FREQUENCY: f64 = 8.0;
/// Standstill: the revolutions, and one more before and after.
const STANDSTILL: f64 = (SCANS + 2.0) / FREQUENCY;
/// Reflectors that are taken to be seen from everywhere, and how far they are from the border of the area, m.
const REFLECTORS: usize = 16;
const BEYOND: f64 = 4.0;
/// What is expected of floor, encoders and laser: the middle one of the standard models.
const NOISE: NoiseModel = NoiseModel { slip: 5e-4, steering: 0.01 * std::f64::consts::PI / 180.0, laser: 1.0 };
const REFLECTOR_NOISE: ReflectorNoise = ReflectorNoise { range: 8e-3, bearing: 8.7e-4, lasting: 0.0 };

const ARCS: std::ops::RangeInclusive<usize> = 2..=10;
const TURNS_DEG: [f64; 7] = [60.0, 90.0, 120.0, 150.0, 180.0, 210.0, 240.0];
/// The smallest steering angle is raised in such steps, rad, where the area is too small for it.
const STEERING_STEP: f64 = 0.05;
/// Smallest range of steering angles that is worth a drive, rad.
const SMALLEST_RANGE: f64 = 0.1;
/// Deviations that count alike: rad, rad, share, m, share, m, m, rad.
const SCALES: [f64; PARAMETERS] = [3e-5, 3e-5, 5e-5, 1.0, 1.0, 2e-4, 2e-4, 3e-5];

/// The best drive for these means.
///
/// # Errors
/// [`PlanError`].
pub fn plan(means: &Means) -> Result<Plan, PlanError> {
    let [low, high] = means.steering;
    let mut best: Option<(f64, Plan)> = None;
    let mut reason = PlanError::TooSmall;
    let mut smallest = low;
    while smallest + SMALLEST_RANGE <= high {
        for turn in TURNS_DEG.map(f64::to_radians) {
            for arcs in ARCS {
                let design = Design { arcs, steering: [smallest, high], turn };
                match candidate(means, design) {
                    Ok(found) => {
                        let cost = cost(&found, means);
                        if best.as_ref().is_none_or(|(least, _)| cost < *least) {
                            best = Some((cost, found));
                        }
                    }
                    Err(PlanError::TooSmall) => break,
                    Err(other) => reason = other,
                }
            }
        }
        smallest += STEERING_STEP;
    }
    best.map(|(_, plan)| plan).ok_or(reason)
}

fn cost(plan: &Plan, means: &Means) -> f64 {
    let mut scales = SCALES;
    scales[2] *= means.vehicle.drive_scale;
    plan.deviations.iter().zip(scales).map(|(deviation, scale)| (deviation / scale).powi(2)).sum()
}

fn candidate(means: &Means, design: Design) -> Result<Plan, PlanError> {
    let segments = design.segments(means.vehicle.wheelbase, Order::ForthAndBack);
    let path = path(&segments, means.vehicle.wheelbase, Pose::default());
    let bounds = bounds(&path);
    let size = bounds[1] - bounds[0];
    let free = means.area.map(|side| side - 2.0 * means.clearance);
    let fits = |width: f64, height: f64| size.x <= width && size.y <= height;
    if !(fits(free[0], free[1]) || fits(free[1], free[0])) {
        return Err(PlanError::TooSmall);
    }
    let options = drive_options(means, &segments);
    let moving = path
        .legs
        .iter()
        .map(|leg| SpeedProfile::new(leg.length(), options.speed, options.acceleration, options.braking).duration());
    let duration = moving.sum::<f64>() + STANDSTILL * (segments.len() + 1) as f64;
    if duration > means.time {
        return Err(PlanError::TooShort);
    }
    let windows = windows(means, &segments, &path, &bounds);
    let free = Free { offsets_differ: true, wheelbase: false, steering_ratio: false };
    let deviations =
        expected_deviations(&windows, &means.vehicle, free, &NOISE).map_err(|_: FitError| PlanError::NotObservable)?;
    Ok(Plan { design, segments, bounds, duration, deviations })
}

/// Corners of the rectangle around the way of R.
fn bounds(path: &Path) -> [Point; 2] {
    const SAMPLES: usize = 24;
    let mut start = path.start;
    let (mut low, mut high) = (start.position(), start.position());
    for leg in &path.legs {
        for sample in 1..=SAMPLES {
            let place = leg.pose(&start, leg.length() * sample as f64 / SAMPLES as f64).position();
            (low, high) = (low.inf(&place), high.sup(&place));
        }
        start = leg.pose(&start, leg.length());
    }
    [low, high]
}

fn reflectors(bounds: &[Point; 2]) -> Vec<Point> {
    let (centre, half) = (0.5 * (bounds[0] + bounds[1]), 0.5 * (bounds[1] - bounds[0]));
    let radius = half.norm() + BEYOND;
    let place = |index: usize| {
        // Not quite regular, so that no turn takes one for another.
        let angle = (index as f64 + 0.3 * (3.0 * index as f64).sin()) / REFLECTORS as f64 * std::f64::consts::TAU;
        centre + Point::new(angle.cos(), angle.sin()) * radius
    };
    (0..REFLECTORS).map(place).collect()
}

/// The windows that the drive will give, without any error.
fn windows(means: &Means, segments: &[PlannedSegment], path: &Path, bounds: &[Point; 2]) -> Vec<Window> {
    let vehicle = &means.vehicle;
    let reflectors = reflectors(bounds);
    let mut pose = path.start;
    let mut windows = Vec::new();
    for (segment, leg) in segments.iter().zip(&path.legs) {
        let sign = leg.direction.sign();
        let offset = if sign < 0.0 { vehicle.offset_backward } else { vehicle.offset_forward };
        let end = leg.segments.iter().fold(pose, |pose, arc| {
            let way = sign * arc.length;
            pose.compose(&Pose::exp(&Twist { x: way, y: 0.0, theta: way * arc.curvature }))
        });
        let (first, second) = (pose.compose(&vehicle.laser), end.compose(&vehicle.laser));
        let seen =
            |from: &Pose, place: &Point| MeanPoint { point: from.inverse_transform(place), count: SCANS as usize };
        let pairs: Vec<_> = reflectors.iter().map(|place| (seen(&first, place), seen(&second, place))).collect();
        let steering = (segment.steering - offset) / vehicle.steering_ratio;
        let mut window = Window {
            start: Time::default(),
            end: Time::default(),
            steps: vec![Step { ticks: sign * segment.wheel_way / vehicle.drive_scale, steering }],
            motion: first.between(&second),
            pose_errors: [Matrix3::zeros(); 2],
            shares_start: !windows.is_empty(),
        };
        if let Some(found) = weighted_motion(&pairs, &window.motion, &REFLECTOR_NOISE)
            && window.set_covariance_parts(&found.parts).is_some()
        {
            windows.push(window);
        }
        pose = end;
    }
    windows
}

fn drive_options(means: &Means, segments: &[PlannedSegment]) -> DriveOptions {
    let mean = segments.iter().map(|segment| segment.steering.cos()).sum::<f64>() / segments.len().max(1) as f64;
    DriveOptions {
        speed: means.speed * mean,
        start_standstill: STANDSTILL,
        end_standstill: STANDSTILL,
        stop_between_legs: STANDSTILL,
        ..DriveOptions::default()
    }
}

impl Plan {
    /// The drive as a scenario, in a world of nothing but reflectors around it. What the vehicle believes of itself is
    /// `tricycle`; in truth it differs from that as vehicles do before their calibration.
    #[must_use]
    pub fn scenario(&self, means: &Means, tricycle: &Tricycle) -> Scenario {
        let legs = path(&self.segments, means.vehicle.wheelbase, Pose::default()).legs;
        let mut vehicle = VehicleOptions::default();
        vehicle.believed.wheelbase = tricycle.wheelbase;
        vehicle.believed.drive_scale = tricycle.drive_scale;
        vehicle.truth.steering_offset_error_deg = 0.5;
        vehicle.truth.steering_offset_backward_error_deg = 0.05;
        vehicle.truth.laser_error = PoseOptions { x: 0.01, y: -0.005, heading_deg: 0.3 };
        let laser = &means.vehicle.laser;
        let reflector = |place: Point| ReflectorShape {
            x: place.x,
            y: place.y,
            radius: 0.04,
            farthest: 60.0,
            facing_deg: None,
            half_width_deg: 60.0,
        };
        let shapes = reflectors(&self.bounds).into_iter().map(reflector).collect();
        let mut scenario = Scenario {
            seed: 1,
            world: WorldOptions::Shapes(Shapes { reflectors: shapes, ..Shapes::default() }),
            path: PathOptions { kind: PathKind::Legs, start: PoseOptions::default(), legs },
            drive: drive_options(means, &self.segments),
            vehicle,
            odometry: OdometryOptions {
                slip: NOISE.slip,
                steering_noise_deg: 0.01,
                leg_steering_error_deg: NOISE.steering.to_degrees(),
                ..OdometryOptions::perfect()
            },
            laser: LaserOptions {
                scans: false,
                mounting: PoseOptions { x: laser.x, y: laser.y, heading_deg: laser.theta.to_degrees() },
                ..LaserOptions::default()
            },
            start: StartOptions::default(),
            ..Scenario::default()
        };
        scenario.reflectors.range_noise = REFLECTOR_NOISE.range;
        scenario.reflectors.bearing_noise_deg = REFLECTOR_NOISE.bearing.to_degrees();
        scenario.reflectors.farthest = 60.0;
        scenario
    }
}

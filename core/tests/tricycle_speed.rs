//! A tricycle whose own controller tells speed and angle, against the circle that it drives.

use agv_core::measurement::{SpeedSample, Time};
use agv_core::odometry::{
    Integration, OdometerParameters, OdometryError, OdometryNoise, TricycleSpeed, Vehicle, VehicleOdometer,
};

const WHEELBASE: f64 = 1.2;
const OFFSET: f64 = 0.02;

fn odometer() -> VehicleOdometer {
    let parameters = OdometerParameters {
        noise: OdometryNoise::default(),
        integration: Integration::Arc,
        fastest: 5.0,
        longest_interval: 0.25,
    };
    let vehicle = Vehicle::TricycleSpeed(TricycleSpeed { wheelbase: WHEELBASE, steering_offset: OFFSET });
    assert_eq!(vehicle.steering_lever(), Some(WHEELBASE));
    VehicleOdometer::new(&vehicle, &parameters)
}

fn at(step: u64) -> Time {
    Time::from_micros(1_000_000 + 10_000 * step)
}

/// The driving wheel stays on a circle of radius L / sin(angle) about a point on the rear axle, and R on one of L / tan(angle).
#[test]
fn it_drives_the_circle_of_its_angle() {
    for (speed, angle) in [(1.0, 0.5_f64), (-0.7, 0.5), (1.3, -1.2), (0.9, 1e-9)] {
        let mut odometer = odometer();
        let sample = |step| SpeedSample { time: at(step), speed, steering: angle - OFFSET };
        assert_eq!(odometer.speed(&sample(0)), Err(OdometryError::First));
        let mut pose = agv_core::geometry::Pose::default();
        for step in 1..=300 {
            pose = pose.compose(&odometer.speed(&sample(step)).unwrap().displacement);
        }
        let way = 3.0 * speed;
        let turned = way * angle.sin() / WHEELBASE;
        let radius = WHEELBASE / angle.tan();
        let (x, y) = (radius * turned.sin(), radius * (1.0 - turned.cos()));
        let wrapped = agv_core::geometry::difference(pose.theta, turned);
        let off = (pose.x - x).hypot(pose.y - y);
        assert!(off < 1e-6 && wrapped.abs() < 1e-9, "{speed} {angle}: {pose:?}, not {x} {y} {turned}");
    }
}

/// At a right angle the vehicle turns on the spot, as fast as the wheel goes around.
#[test]
fn it_turns_on_the_spot() {
    let mut odometer = odometer();
    let sample = |step| SpeedSample { time: at(step), speed: 0.6, steering: std::f64::consts::FRAC_PI_2 - OFFSET };
    let _ = odometer.speed(&sample(0));
    let moved = odometer.speed(&sample(1)).unwrap().displacement;
    assert!(moved.x.abs() < 1e-12 && moved.y.abs() < 1e-12, "{moved:?}");
    assert!((moved.theta - 0.006 / WHEELBASE).abs() < 1e-12, "{moved:?}");
    // Nobody steers by more than half a turn.
    let wild = SpeedSample { time: at(2), speed: 0.6, steering: 3.2 };
    assert_eq!(odometer.speed(&wild), Err(OdometryError::Implausible));
}

/// Speeds cannot be taken for others, as counters can after a whole turn: the settings alone say what a pause is.
#[test]
fn the_longest_interval_is_that_of_the_settings() {
    let vehicle = Vehicle::TricycleSpeed(TricycleSpeed { wheelbase: WHEELBASE, steering_offset: OFFSET });
    for (longest_interval, step, expected) in [
        (0.25, 25, None),
        (0.25, 26, Some(OdometryError::Pause)),
        (2.0, 150, None),
        (2.0, 201, Some(OdometryError::Pause)),
    ] {
        let parameters = OdometerParameters {
            noise: OdometryNoise::default(),
            integration: Integration::Arc,
            fastest: 5.0,
            longest_interval,
        };
        let mut odometer = VehicleOdometer::new(&vehicle, &parameters);
        let sample = |step| SpeedSample { time: at(step), speed: 0.5, steering: 0.0 };
        assert_eq!(odometer.speed(&sample(0)), Err(OdometryError::First));
        assert_eq!(odometer.speed(&sample(step)).err(), expected, "{longest_interval} s, {step}");
    }
}

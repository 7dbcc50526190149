//! Lasting errors of the odometry, in every direction of travel.

use agv_core::geometry::{Pose, Twist};
use agv_core::measurement::{EncoderSample, PoseIncrement, SpeedSample, Time, WheelReading, WheelSample};
use agv_core::odometry::{BiasJacobian, Motion, OdometryBias, VehicleOdometer};

use super::kind::{Kind, Running, STEERING_TICK};
use super::run::course;
use super::simulator::{Drive, Errors, ring};

/// The motion that a vehicle reports of an arc if its wheels roll so many times as far.
fn reported(kind: Kind, arc: &Twist, share: f64) -> Motion {
    const TICK: f64 = 1e-9;
    const SECONDS: f64 = 0.01;
    let vehicle = kind.vehicle(TICK);
    let parameters = agv_core::localizer::Parameters::new(vehicle, Pose::default());
    let mut odometer = VehicleOdometer::new(&vehicle, &parameters.odometer());
    let mut running = Running::new(kind);
    let rolled = running.roll(arc);
    let count = |way: f64| ((way * share / TICK).round() as i64).rem_euclid(1 << 32) as u32;
    let angle = |wheel: usize| ((running.steering[wheel] / STEERING_TICK).round() as i64).rem_euclid(1 << 32) as u32;
    let time = |seconds: f64| Time::from_seconds(1.0 + seconds);
    let mut report = |is_end: bool| {
        let time = time(if is_end { SECONDS } else { 0.0 });
        let way = |wheel: usize| if is_end { rolled[wheel] } else { 0.0 };
        match kind {
            Kind::Tricycle => odometer.encoders(&EncoderSample { time, drive: count(way(0)), steering: angle(0) }),
            Kind::TricycleSpeed | Kind::CarSpeed => {
                let sample = SpeedSample { time, speed: share * rolled[0] / SECONDS, steering: running.steering[0] };
                odometer.speed(&sample)
            }
            Kind::Increments => {
                let scaled = Twist { x: share * arc.x, y: share * arc.y, theta: share * arc.theta };
                odometer.increment(&PoseIncrement { time, displacement: Pose::exp(&scaled) })
            }
            _ => {
                let mut wheels = [WheelReading::default(); 4];
                for (wheel, reading) in wheels.iter_mut().enumerate() {
                    *reading = WheelReading { count: count(way(wheel)), steering: angle(wheel) };
                }
                odometer.wheels(&WheelSample { time, wheels })
            }
        }
    };
    assert!(report(false).is_err());
    report(true).unwrap()
}

/// Arcs of a hundredth of a second that the vehicle can drive: forward, backward, in a bend, on the spot, sideways and obliquely.
fn arcs(kind: Kind) -> Vec<Twist> {
    let arc = |x: f64, y: f64, theta: f64| Twist { x, y, theta };
    let mut arcs = vec![arc(0.01, 0.0, 0.0), arc(-0.01, 0.0, 0.0), arc(0.01, 0.0, 0.006), arc(-0.01, 0.0, 0.006)];
    if kind.turns_on_the_spot() {
        arcs.push(arc(0.0, 0.0, 0.01));
    }
    if kind.moves_sideways() {
        arcs.extend([arc(0.0, 0.01, 0.0), arc(0.0, -0.01, 0.005), arc(0.007, 0.007, 0.0), arc(-0.007, 0.007, 0.004)]);
    }
    arcs
}

#[test]
fn every_vehicle_changes_with_its_scale_as_finite_differences_of_its_reports_do() {
    const STEP: f64 = 1e-3;
    for kind in Kind::ALL {
        for arc in arcs(kind) {
            let [more, same, less] =
                [1.0 + STEP, 1.0, 1.0 - STEP].map(|share| reported(kind, &arc, share).displacement);
            let jacobian = BiasJacobian::of(&same, kind.vehicle(1e-4).steering_lever());
            let by = |more: f64, less: f64| (more - less) / (2.0 * STEP);
            let expected = [by(more.x, less.x), by(more.y, less.y), by(more.theta, less.theta)];
            for (found, expected) in jacobian.scale.iter().zip(expected) {
                assert!((found - expected).abs() < 2e-6, "{kind:?} {arc:?}: {:?} {expected}", jacobian.scale);
            }
        }
    }
}

/// A turn that is not reported, for each metre forward or of another direction: the arc with it, beside the one without.
#[test]
fn a_turn_that_is_not_reported_changes_a_displacement_as_finite_differences_do() {
    const STEP: f64 = 1e-4;
    for kind in Kind::ALL.into_iter().filter(|kind| kind.vehicle(1e-4).steering_lever().is_none()) {
        for arc in arcs(kind) {
            let length = arc.x.hypot(arc.y);
            let at = |turn: f64| Pose::exp(&Twist { theta: arc.theta + turn * length, ..arc });
            let (more, less) = (at(STEP), at(-STEP));
            let jacobian = BiasJacobian::of_length(&at(0.0), None, length);
            let by = |more: f64, less: f64| (more - less) / (2.0 * STEP);
            let expected = [by(more.x, less.x), by(more.y, less.y), by(more.theta, less.theta)];
            for (found, expected) in jacobian.steering.iter().zip(expected) {
                assert!((found - expected).abs() < 1e-6, "{kind:?} {arc:?}: {:?} {expected}", jacobian.steering);
            }
        }
    }
}

/// A steered wheel that stands otherwise than it is told to: the arc of the angle that it has.
#[test]
fn a_steering_error_changes_a_displacement_as_finite_differences_do() {
    use agv_core::odometry::{Control, Integration};
    const STEP: f64 = 1e-5;
    for steering in [-0.7, -0.1, 0.0, 0.3, 1.2] {
        for distance in [0.01, -0.01] {
            let at = |angle: f64| {
                let control = Control { distance, steering_start: angle, steering_end: angle };
                control.displacement(1.2, Integration::Arc)
            };
            let (more, less) = (at(steering + STEP), at(steering - STEP));
            let jacobian = BiasJacobian::of(&at(steering), Some(1.2));
            let by = |more: f64, less: f64| (more - less) / (2.0 * STEP);
            let expected = [by(more.x, less.x), by(more.y, less.y), by(more.theta, less.theta)];
            for (found, expected) in jacobian.steering.iter().zip(expected) {
                assert!((found - expected).abs() < 1e-4, "{steering}: {:?} {expected}", jacobian.steering);
            }
        }
    }
}

/// What was learnt of a scale is taken from a motion once, in every direction.
#[test]
fn a_known_scale_is_corrected_once_in_every_direction() {
    let bias = OdometryBias { scale: -0.01, steering: 0.0 };
    for kind in Kind::ALL {
        for arc in arcs(kind) {
            let reported = reported(kind, &arc, 1.0 / 0.99);
            let corrected = reported.corrected(&bias, kind.vehicle(1e-4).steering_lever()).displacement;
            let off = Pose::exp(&arc).between(&corrected);
            assert!(off.x.abs() < 3e-6 && off.y.abs() < 3e-6 && off.theta.abs() < 3e-6, "{kind:?} {arc:?}: {off:?}");
        }
    }
}

/// One wheel that is too large or too small, and nothing in sight: the pose stays within its level in every direction, whatever was learnt in
/// another one before.
#[test]
fn a_wheel_of_another_size_is_held_in_every_direction() {
    let mut above = Vec::new();
    for kind in [Kind::Omni3, Kind::Omni4, Kind::Mecanum, Kind::BiSteerable] {
        for wheel in 0..if kind == Kind::BiSteerable { 2 } else { 3 } {
            for error in [-0.05, 0.05] {
                for (along, aside) in [(-0.8, 0.0), (0.0, 0.8), (0.0, -0.8), (0.55, 0.55)] {
                    let motion = move |time: f64| match time {
                        ..6.0 => (0.0, 0.0, 0.0),
                        ..20.0 => (0.8, 0.0, 0.3 * (0.3 * (time - 6.0)).sin()),
                        _ => (along, aside, 0.0),
                    };
                    let mut errors = Errors { slip: 1e-3, yaw: 1e-4, ..Errors::SMALL };
                    errors.wheels[wheel] = error;
                    let course = course(&Drive {
                        motion: Box::new(motion),
                        seconds: 40.0,
                        reflectors: ring(24, 5.0, 0.0, 22.0, 2),
                        sees: Box::new(|time, _| time < 20.0),
                        errors,
                        ..Drive::new(kind)
                    });
                    if course.above > 0 {
                        above.push(format!(
                            "{kind:?} wheel {wheel} {error} toward ({along}, {aside}): {} of {}, error over level {:.2}",
                            course.above, course.outputs, course.ratio
                        ));
                    }
                }
            }
        }
    }
    assert!(above.is_empty(), "{}: {above:#?}", above.len());
}

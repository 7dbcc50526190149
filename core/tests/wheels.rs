//! Vehicles of several wheels: against closed forms, finite differences, and rigid motions made apart.
#![allow(clippy::indexing_slicing, clippy::unwrap_used, reason = "a panic is how a test fails")]

use agv_core::geometry::{Pose, Twist, difference};
use agv_core::measurement::{Time, WheelReading, WheelSample};
use agv_core::odometry::{
    AckermannWheels, AngleEncoder, Believed, BiSteerable, Contact, Control, CounterRange, Differential, DrivenWheel,
    Integration, Kinematics, Mecanum, Odometer, OdometerParameters, OdometryError, OdometryNoise, Omnidirectional,
    SteeredWheel, Tricycle, Wheel, WheelBased, WheelMotion, WheelParameter, WheelPath, WheelSet, Wheels,
};
use nalgebra::Vector3;
use proptest::prelude::*;

const ENCODER: AngleEncoder = AngleEncoder { scale: 1e-6, range: CounterRange::BITS_32 };
const DRIVEN: DrivenWheel = DrivenWheel { radius: 0.1, turn: ENCODER };
const INTEGRATIONS: [Integration; 3] = [Integration::RungeKutta2, Integration::Arc, Integration::RungeKutta4];
const PARAMETERS: [WheelParameter; 6] = [
    WheelParameter::X,
    WheelParameter::Y,
    WheelParameter::Heading,
    WheelParameter::Radius,
    WheelParameter::SteeringRatio,
    WheelParameter::Roller,
];

fn differential() -> Differential {
    Differential { track: 0.5, left: DRIVEN, right: DrivenWheel { radius: 0.101, ..DRIVEN } }
}

fn bi_steerable() -> BiSteerable {
    let front = SteeredWheel { x: 0.7, y: 0.1, drive: DRIVEN, steering: ENCODER, steering_offset: 0.01 };
    BiSteerable { front, rear: SteeredWheel { x: -0.6, y: -0.1, steering_offset: -0.02, ..front } }
}

fn tricycle() -> Tricycle {
    Tricycle {
        wheelbase: 1.5,
        drive_scale: 1e-6,
        drive_range: CounterRange::BITS_32,
        steering_scale: 1e-6,
        steering_range: CounterRange::BITS_32,
        steering_offset_forward: 0.013,
        steering_offset_backward: 0.013,
    }
}

/// Every kinematics, with its wheels.
fn vehicles() -> Vec<(&'static str, Vec<Wheel>)> {
    let of = |vehicle: &dyn Fn() -> Vec<Wheel>| vehicle();
    let car = AckermannWheels { rear: differential(), wheelbase: 0.9, steering: ENCODER, steering_offset: 0.01 };
    let three = Omnidirectional { arm: 0.2, first: 1.0, driven: [DRIVEN; 3] };
    let four = Omnidirectional { arm: 0.2, first: 0.7, driven: [DRIVEN; 4] };
    let mecanum = Mecanum { wheelbase: 0.4, track: 0.5, driven: [DRIVEN; 4] };
    vec![
        ("tricycle", tricycle().wheels().to_vec()),
        ("differential", of(&|| differential().wheels().as_ref().to_vec())),
        ("bi-steerable", of(&|| bi_steerable().wheels().as_ref().to_vec())),
        ("Ackermann", of(&|| car.wheels().as_ref().to_vec())),
        ("three omnidirectional wheels", of(&|| three.wheels().as_ref().to_vec())),
        ("four omnidirectional wheels", of(&|| four.wheels().as_ref().to_vec())),
        ("mecanum", of(&|| mecanum.wheels().as_ref().to_vec())),
    ]
}

/// What every wheel does while R moves by `motion` at constant velocity, by plane rigid kinematics; None where the vehicle cannot.
fn wheel_motions(wheels: &[Wheel], motion: &Vector3<f64>) -> Option<Vec<WheelMotion>> {
    let moved = |wheel: &Wheel| {
        let (x, y) = (motion.x - motion.z * wheel.y, motion.y + motion.z * wheel.x);
        let direction = if wheel.steering.is_some() { y.atan2(x) } else { wheel.heading };
        let steering = direction - wheel.heading;
        let (along, across) = (x * direction.cos() + y * direction.sin(), y * direction.cos() - x * direction.sin());
        // Rollers carry what is across their axis.
        let turn = match wheel.contact {
            Contact::Tyre if across.abs() > 1e-12 => return None,
            Contact::Tyre => along,
            Contact::Rollers(angle) => along + across * angle.tan(),
        };
        let turn = if wheel.radius == 0.0 { 0.0 } else { turn / wheel.radius };
        Some(WheelMotion { turn, steering_start: steering, steering_end: steering })
    };
    wheels.iter().map(moved).collect()
}

fn same(a: &Pose, b: &Pose, tolerance: f64) -> bool {
    (a.x - b.x).abs() < tolerance && (a.y - b.y).abs() < tolerance && difference(a.theta, b.theta).abs() < tolerance
}

proptest! {
    #[test]
    fn every_vehicle_finds_the_rigid_motion_that_moved_its_wheels(
        x in 0.01f64..0.3, y in -0.2f64..0.2, turn in -0.3f64..0.3,
    ) {
        for (name, wheels) in vehicles() {
            // What cannot move across does not.
            let motion = [Vector3::new(x, y, turn), Vector3::new(x, 0.0, turn)]
                .into_iter()
                .find_map(|motion| Some((motion, wheel_motions(&wheels, &motion)?)));
            let (motion, moved) = motion.unwrap();
            let noise = OdometryNoise::default();
            let set = WheelSet::of(&wheels);
            let path = WheelPath::new(&set, &moved, &noise, Integration::Arc).unwrap();
            let end = Pose::exp(&Twist { x: motion.x, y: motion.y, theta: motion.z });
            prop_assert!(same(&path.displacement(), &end, 1e-12), "{name}: {:?} {end:?}", path.displacement());
            prop_assert!(path.fit().slip.abs() < 1e-12, "{name}");
        }
    }

    #[test]
    fn the_tricycle_of_wheels_is_the_closed_form(
        distance in -0.5f64..0.5, start in -1.2f64..1.2, change in -0.1f64..0.1,
    ) {
        let wheels = tricycle().wheels();
        let steered = WheelMotion { turn: distance, steering_start: start, steering_end: start + change };
        let offset = tricycle().steering_offset_forward;
        let control = Control { distance, steering_start: start + offset, steering_end: start + change + offset };
        for integration in INTEGRATIONS {
            let motions = [steered, WheelMotion::default()];
            let noise = OdometryNoise::default();
            let set = WheelSet::of(&wheels);
            let path = WheelPath::new(&set, &motions, &noise, integration).unwrap();
            prop_assert!(same(&path.displacement(), &control.displacement(1.5, integration), 1e-13));
            if integration == Integration::RungeKutta2 {
                let closed = control.jacobian(1.5);
                let by_distance = path.derivative(0, WheelParameter::Turn) / wheels[0].radius;
                prop_assert!((by_distance - closed.column(0)).norm() < 1e-12);
                prop_assert!((path.derivative(0, WheelParameter::Heading) - closed.column(1)).norm() < 1e-12);
            }
        }
    }

    /// Contradicting wheels too: the derivative of a least-squares solution holds where the residual is not zero.
    #[test]
    fn every_jacobian_is_a_finite_difference(
        turns in prop::array::uniform4(-4.0f64..4.0),
        steerings in prop::array::uniform4(-1.0f64..1.0),
        change in -0.2f64..0.2,
        which in 0_usize..7,
    ) {
        let (name, wheels) = vehicles().swap_remove(which);
        let noise = OdometryNoise::default();
        let motions: Vec<WheelMotion> = turns
            .iter()
            .zip(steerings)
            .map(|(turn, start)| WheelMotion { turn: *turn, steering_start: start, steering_end: start + change })
            .take(wheels.len())
            .collect();
        for integration in INTEGRATIONS {
            let end = |wheels: &[Wheel], motions: &[WheelMotion]| {
                let end = WheelPath::new(&WheelSet::of(wheels), motions, &noise, integration).unwrap().displacement();
                Vector3::new(end.x, end.y, end.theta)
            };
            let set = WheelSet::of(&wheels);
            let path = WheelPath::new(&set, &motions, &noise, integration).unwrap();
            let step = 1e-6;
            for number in 0..wheels.len() {
                let slope = |change: &dyn Fn(f64) -> Vector3<f64>| {
                    let mut difference = change(step) - change(-step);
                    difference.z = agv_core::geometry::wrap(difference.z);
                    difference / (2.0 * step)
                };
                for parameter in PARAMETERS {
                    let expected = slope(&|step| {
                        let mut changed = wheels.clone();
                        changed[number] = changed[number].changed(parameter, step);
                        let mut motions = motions.clone();
                        if parameter == WheelParameter::SteeringRatio {
                            motions[number].steering_start *= 1.0 + step;
                            motions[number].steering_end *= 1.0 + step;
                        }
                        end(&changed, &motions)
                    });
                    let found = path.derivative(number, parameter);
                    if parameter != WheelParameter::SteeringRatio {
                        for other in 0..wheels.len() {
                            let slip = |step: f64| {
                                let mut changed = wheels.clone();
                                changed[number] = changed[number].changed(parameter, step);
                                WheelPath::new(&WheelSet::of(&changed), &motions, &noise, integration).unwrap().slip(other)
                            };
                            let found = path.slip_derivative(other, number, parameter);
                            for (found, (more, less)) in found.into_iter().zip(slip(step).into_iter().zip(slip(-step))) {
                                let expected = (more - less) / (2.0 * step);
                                prop_assert!((found - expected).abs() < 1e-6 * (1.0 + expected.abs()), "{name} {other}");
                            }
                        }
                    }
                    let is_absent = parameter == WheelParameter::SteeringRatio && wheels[number].steering.is_none();
                    let expected = if is_absent { Vector3::zeros() } else { expected };
                    prop_assert!(
                        (found - expected).norm() < 1e-6 * (1.0 + expected.norm()),
                        "{name} {integration:?} {number} {parameter:?}: {found} {expected}"
                    );
                }
                if wheels[number].turn.is_some() {
                    let expected = slope(&|step| {
                        let mut motions = motions.clone();
                        motions[number].turn += step;
                        end(&wheels, &motions)
                    });
                    let found = path.derivative(number, WheelParameter::Turn);
                    prop_assert!((found - expected).norm() < 1e-6 * (1.0 + expected.norm()), "{name} turn of {number}");
                }
            }
        }
    }
}

fn odometer<V: WheelBased>(vehicle: V, noise: OdometryNoise) -> Odometer<V> {
    let integration = Integration::Arc;
    Odometer::new(vehicle, &OdometerParameters { noise, integration, fastest: 5.0, longest_interval: 1.0 })
}

/// Counters after one step with those turns (rad) and steering angles (rad).
fn samples(turns: [f64; 4], steerings: [f64; 4]) -> [WheelSample; 2] {
    let count = |angle: f64| ENCODER.range.wrap((angle / ENCODER.scale).round() as i64);
    [0.0, 1.0].map(|share: f64| WheelSample {
        time: Time::from_seconds(share * 0.1),
        wheels: [0, 1, 2, 3]
            .map(|wheel| WheelReading { count: count(turns[wheel] * share), steering: count(steerings[wheel]) }),
    })
}

#[test]
fn a_differential_vehicle_turns_by_the_difference_of_its_wheels() {
    let mut odometer = odometer(differential(), OdometryNoise::default());
    let [first, second] = samples([1.0, 2.0, 0.0, 0.0], [0.0; 4]);
    assert_eq!(odometer.report(&first), Err(OdometryError::First));
    let motion = odometer.report(&second).unwrap();
    let (left, right) = (0.1, 0.202);
    let end = Pose::exp(&Twist { x: 0.5 * (left + right), y: 0.0, theta: (right - left) / 0.5 });
    assert!(same(&motion.displacement, &end, 1e-9), "{motion:?}");
    assert!((motion.distance - 0.5 * (left + right)).abs() < 1e-9);
}

/// Each wheel slips for itself: variances by hand.
#[test]
fn slip_of_each_wheel_is_the_covariance() {
    let noise = OdometryNoise { slip: 0.01, yaw: 0.0, speed: 0.0, ..OdometryNoise::default() };
    let mut odometer = odometer(Differential { right: DRIVEN, ..differential() }, noise);
    let [first, second] = samples([2.0, 2.0, 0.0, 0.0], [0.0; 4]);
    odometer.report(&first).unwrap_err();
    let covariance = odometer.report(&second).unwrap().covariance;
    let variance = 1e-4 * 0.2;
    assert!((covariance[(0, 0)] - 0.5 * variance).abs() < 1e-12, "{covariance}");
    assert!((covariance[(2, 2)] - 2.0 * variance / 0.25).abs() < 1e-10, "{covariance}");
}

/// A wheel of a redundant vehicle that slips is measured and raises the noise; without redundancy nobody sees it.
#[test]
fn what_redundant_wheels_say_differently_is_slip() {
    let steps = |turns: [f64; 4]| {
        let mut odometer = odometer(bi_steerable(), OdometryNoise::default());
        let [first, second] = samples(turns, [-0.01, 0.02, 0.0, 0.0]);
        odometer.report(&first).unwrap_err();
        odometer.report_with_slip(&second).unwrap()
    };
    let ((rolling, none), (slipping, slip)) = (steps([3.0, 3.0, 0.0, 0.0]), steps([3.6, 3.0, 0.0, 0.0]));
    // Both roll straight ahead: 0.3 m, and a fifth of that too much in front.
    assert!(none.abs() < 1e-6 && slip > 0.02 && slip < 0.06, "{none} {slip}");
    assert!(slipping.covariance.trace() > 10.0 * rolling.covariance.trace());
    let mut odometer = odometer(differential(), OdometryNoise::default());
    let [first, second] = samples([3.6, 3.0, 0.0, 0.0], [0.0; 4]);
    odometer.report(&first).unwrap_err();
    assert!(odometer.report_with_slip(&second).unwrap().1.abs() < 1e-9);
}

/// A castor alone determines nothing.
#[test]
fn wheels_that_do_not_determine_the_motion_give_none() {
    let [wheel, _] = tricycle().wheels();
    let motions = [WheelMotion { turn: 1.0, ..WheelMotion::default() }];
    assert!(WheelPath::new(&WheelSet::of(&[wheel]), &motions, &OdometryNoise::default(), Integration::Arc).is_none());
}

/// Wheels that all roll the same way on rollers tell nothing of the way across, wherever they stand. Rounding makes the
/// determinant of their equations some small number of either sign.
#[test]
fn parallel_wheels_that_may_move_across_do_not_determine_the_motion() {
    let noise = OdometryNoise::default();
    for degree in 0..180 {
        let heading = f64::from(degree).to_radians();
        let wheels = [(0.31, 0.27), (-0.43, 0.19), (0.17, -0.37), (-0.29, -0.23)]
            .map(|(x, y)| DRIVEN.at(x, y, heading, Contact::Rollers(0.0)));
        let motions = [WheelMotion { turn: 1.0, ..WheelMotion::default() }; 4];
        let set = WheelSet::of(&wheels);
        let path = WheelPath::new(&set, &motions, &noise, Integration::Arc);
        assert!(path.is_none(), "toward {degree} deg they moved by {:?}", path.unwrap().displacement());
    }
}

/// The end of an arc is an integral along it, `x' = s cos(tu)`, `y' = s sin(tu)` over u from 0 to 1: so is its derivative.
#[test]
fn the_derivative_of_a_flat_arc_is_that_of_its_integral() {
    let vehicle = Differential { track: 0.5, left: DRIVEN, right: DRIVEN };
    let wheels = vehicle.wheels();
    let noise = OdometryNoise::default();
    for turn in [1e-4, -3e-3, 5e-3, -9.9e-3, 9.99e-3, 1.01e-2, -0.02, 0.3] {
        let (middle, half_track) = (1.2, 0.25);
        let motions = [middle - half_track * turn, middle + half_track * turn]
            .map(|way| WheelMotion { turn: way / 0.1, ..WheelMotion::default() });
        let set = WheelSet::of(wheels.as_ref());
        let path = WheelPath::new(&set, &motions, &noise, Integration::Arc).unwrap();
        let found = path.derivative(1, WheelParameter::Turn) / 0.1;
        // A way of the right wheel is half as much of the middle, and turns by its share of the track.
        let integral = |of: &dyn Fn(f64) -> f64| {
            let steps = 200;
            let at = |step: u32| of(f64::from(step) / f64::from(steps));
            let sum = (0..steps / 2).map(|pair| at(2 * pair) + 4.0 * at(2 * pair + 1) + at(2 * pair + 2)).sum::<f64>();
            sum / (3.0 * f64::from(steps))
        };
        let (by_way, by_turn) = (0.5, 1.0 / 0.5);
        let expected = Vector3::new(
            integral(&|u| by_way * (turn * u).cos() - by_turn * middle * u * (turn * u).sin()),
            integral(&|u| by_way * (turn * u).sin() + by_turn * middle * u * (turn * u).cos()),
            by_turn,
        );
        assert!((found - expected).norm() < 1e-11, "{turn} rad: {found} {expected}");
    }
}

/// Each wheel is wrong for itself by its speed's noise over the time: variances by hand.
#[test]
fn noise_of_each_wheels_speed_is_the_covariance() {
    let noise = OdometryNoise { speed: 0.2, slip: 0.0, yaw: 0.0, ..OdometryNoise::default() };
    let mut odometer = odometer(Differential { right: DRIVEN, ..differential() }, noise);
    let [first, second] = samples([2.0, 2.0, 0.0, 0.0], [0.0; 4]);
    odometer.report(&first).unwrap_err();
    let covariance = odometer.report(&second).unwrap().covariance;
    // 0.2 m/s for 0.1 s.
    let variance = 0.02 * 0.02;
    assert!((covariance[(0, 0)] - 0.5 * variance).abs() < 1e-9, "{covariance}");
    assert!((covariance[(2, 2)] - 2.0 * variance / 0.25).abs() < 1e-9, "{covariance}");
}

/// A wheel without a radius says that nothing moves along it, whatever its counter does: no noise of its turn is any way.
#[test]
fn a_counted_wheel_without_a_radius_adds_no_noise_of_its_speed() {
    let noise = OdometryNoise { speed: 0.2, slip: 0.0, yaw: 0.0, ..OdometryNoise::default() };
    let across = DrivenWheel { radius: 0.0, ..DRIVEN }.at(0.0, 0.0, std::f64::consts::FRAC_PI_2, Contact::Rollers(0.0));
    let [left, right] = [0.25, -0.25].map(|y| DRIVEN.at(0.0, y, 0.0, Contact::Rollers(0.0)));
    let [first, second] = samples([2.0, 2.0, 1.0, 0.0], [0.0; 4]);
    let believed = Believed { noise, integration: Integration::Arc, was_backward: false };
    let step = Wheels([left, right, across]).step(&first, &second, 0.1, &believed);
    assert!(same(&step.displacement, &Pose::new(0.2, 0.0, 0.0), 1e-9), "{step:?}");
    let variance = 0.02 * 0.02;
    assert!((step.covariance[(0, 0)] - 0.5 * variance).abs() < 1e-9, "{}", step.covariance);
    // An arc leads to the side by half of its way for each radian of its turn.
    let side = 0.1 * 0.1 * 2.0 * variance / 0.25;
    assert!((step.covariance[(1, 1)] - side).abs() < 1e-9, "{}", step.covariance);
}

#[test]
fn wheels_of_which_the_fastest_may_go_half_its_counters_range_are_not_believed() {
    // Half of 16 bits are 0.328 m at 0.1 m radius, which 5 m/s are in 65.5 ms.
    let short = AngleEncoder { scale: 1e-4, range: CounterRange::BITS_16 };
    let wheel = DrivenWheel { turn: short, ..DRIVEN };
    for (micros, is_told) in [(60_000, true), (65_000, true), (66_000, false), (130_000, false)] {
        // The other wheel's counter is long enough for any time.
        let mut odometer = odometer(Differential { track: 0.5, left: DRIVEN, right: wheel }, OdometryNoise::default());
        let way = f64::from(micros) * 4.9e-6;
        let count = |encoder: &AngleEncoder, share: f64| {
            encoder.range.wrap((share * way / (0.1 * encoder.scale)).round() as i64)
        };
        let sample = |time, share| {
            let [left, right] = [ENCODER, short].map(|encoder| count(&encoder, share));
            let reading = |count| WheelReading { count, steering: 0 };
            WheelSample { time: Time::from_micros(time), wheels: [left, right, 0, 0].map(reading) }
        };
        assert_eq!(odometer.report(&sample(0, 0.0)), Err(OdometryError::First));
        let told = odometer.report(&sample(micros as u64, 1.0));
        if is_told {
            assert!((told.unwrap().displacement.x - way).abs() < 2e-5, "{micros} us: {told:?}");
        } else {
            assert_eq!(told, Err(OdometryError::Pause), "{micros} us");
        }
    }
}

#[test]
fn a_steering_ratio_of_two_per_cent_more_makes_the_encoders_angle_that_much_larger() {
    let steered = bi_steerable().wheels().as_ref()[0];
    let scale = |change| steered.changed(WheelParameter::SteeringRatio, change).steering.unwrap().scale;
    assert!((scale(0.02) - 1.02e-6).abs() < 1e-18 && (scale(-0.5) - 0.5e-6).abs() < 1e-18);
    let fixed = DRIVEN.at(0.0, 0.25, 0.0, Contact::Tyre);
    assert_eq!(fixed.changed(WheelParameter::SteeringRatio, 0.02), fixed);
}

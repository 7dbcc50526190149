//! Motions with their uncertainty: what samples become, parts of a motion, and motion that nobody reports.

use std::f64::consts::FRAC_PI_2;

use agv_core::geometry::{Pose, Twist};
use agv_core::measurement::{PoseIncrement, SpeedSample, Time};
use agv_core::odometry::{
    Ackermann, Coasting, Control, CounterRange, Integration, Motion, OdometerParameters, OdometryBias, OdometryError,
    OdometryNoise, Tricycle, UnknownAcceleration, Vehicle, VehicleOdometer,
};
use nalgebra::{Matrix2, Matrix3, Matrix3x2};

const TRICYCLE: Vehicle = Vehicle::Tricycle(Tricycle {
    wheelbase: 1.4,
    drive_scale: 1e-4,
    drive_range: CounterRange::BITS_32,
    steering_scale: 1e-3,
    steering_range: CounterRange::BITS_16,
    steering_offset_forward: 0.0,
    steering_offset_backward: 0.0,
});
const CAR: Vehicle = Vehicle::Ackermann(Ackermann { wheelbase: 2.83, encoder_offset: 0.76 });

const UNKNOWN: UnknownAcceleration = UnknownAcceleration { along: 1.5, aside: 0.0, turn: 0.7 };

const NOISE: OdometryNoise = OdometryNoise {
    speed: 0.05,
    steering: 0.002,
    slip: 0.006,
    side_slip: 0.003,
    yaw: 0.004,
    turn: 0.05,
    unknown_acceleration: 1.5,
    unknown_turn: 0.7,
};

fn odometer(vehicle: Vehicle, fastest: f64) -> VehicleOdometer {
    VehicleOdometer::new(
        &vehicle,
        &OdometerParameters { noise: NOISE, integration: Integration::Arc, fastest, longest_interval: 1.0 },
    )
}

fn time(micros: u64) -> Time {
    Time::from_micros(micros)
}

fn is_same(a: &Pose, b: &Pose) -> bool {
    let off = a.between(b);
    off.x.abs() < 1e-12 && off.y.abs() < 1e-12 && off.theta.abs() < 1e-12
}

#[test]
fn noise_of_controls_enters_by_their_derivatives_and_the_rest_by_the_way() {
    for distance in [0.3, -0.3] {
        let control = Control { distance, steering_start: 0.4, steering_end: 0.5 };
        let end = |distance: f64, shift: f64| {
            let moved = Control { distance, steering_start: 0.4 + shift, steering_end: 0.5 + shift };
            let pose = moved.displacement(1.4, Integration::RungeKutta2);
            nalgebra::Vector3::new(pose.x, pose.y, pose.theta)
        };
        let step = 1e-6;
        let jacobian = Matrix3x2::from_columns(&[
            (end(distance + step, 0.0) - end(distance - step, 0.0)) / (2.0 * step),
            (end(distance, step) - end(distance, -step)) / (2.0 * step),
        ]);
        // 0.05 m/s for 0.2 s, and 6 mm for a square root of a metre of 0.3 m.
        let of_way = (0.05_f64 * 0.2).powi(2) + 0.006_f64.powi(2) * 0.3;
        let controls = Matrix2::new(of_way, 0.0, 0.0, 0.002_f64.powi(2));
        let turn = 0.3 / 1.4 * 0.45_f64.sin();
        let of_heading = 0.004_f64.powi(2) * 0.3 + 0.05_f64.powi(2) * turn;
        let floor = Matrix3::from_diagonal(&[0.0, 0.003_f64.powi(2) * 0.3, of_heading].into());
        let expected = jacobian * controls * jacobian.transpose() + floor;
        let stated = NOISE.of_control(&control, 1.4, 0.2);
        assert!((stated - expected).norm() < 1e-6 * expected.norm(), "{stated} {expected}");
    }
    let of_way = (0.05_f64 * 0.2).powi(2) + 0.006_f64.powi(2) * 0.3;
    let expected = Matrix3::from_diagonal(&[of_way, 0.003_f64.powi(2) * 0.3, 0.004_f64.powi(2) * 0.3].into());
    assert!((NOISE.of_displacement(0.3, 0.0, 0.2) - expected).norm() < 1e-15);
    // A turn on the spot moves nothing, and its heading is uncertain all the same.
    for turn in [0.8, -0.8] {
        // Two wheels 0.8 m apart roll 0.32 m each, with a slip of 6 mm for a root of a metre.
        let by_slip = 2.0 * 0.006_f64.powi(2) * 0.32 / 0.8_f64.powi(2);
        let of_heading = 0.05_f64.powi(2) * 0.8 + by_slip;
        let expected = Matrix3::from_diagonal(&[(0.05_f64 * 0.2).powi(2), 0.0, of_heading].into());
        assert!((NOISE.of_displacement(0.0, turn, 0.2) - expected).norm() < 1e-15);
    }
}

/// A motion of 40 ms on an arc, and the pose that its velocity leads to after `seconds`.
fn arc() -> (Motion, impl Fn(f64) -> Pose) {
    let at = |seconds: f64| Pose::exp(&Twist { x: 1.2 * seconds, y: 0.1 * seconds, theta: 0.8 * seconds });
    let motion = Motion {
        start: time(1_000_000),
        end: time(1_040_000),
        displacement: at(0.04),
        covariance: Matrix3::new(4e-6, 1e-7, 0.0, 1e-7, 2e-6, 3e-8, 0.0, 3e-8, 1e-6),
        distance: 0.05,
    };
    (motion, at)
}

#[test]
fn parts_of_a_motion_keep_its_velocity() {
    let (motion, at) = arc();
    let cases = [(0.5, 0.0), (1.0, 0.0), (1.01, 0.25), (1.03, 0.75), (1.04, 1.0), (2.0, 1.0)];
    for (seconds, share) in cases {
        let (first, second) = motion.split(Time::from_seconds(seconds));
        let cut = time(1_000_000 + (share * 40_000.0) as u64);
        assert_eq!((first.start, first.end, second.start, second.end), (motion.start, cut, cut, motion.end));
        assert!(is_same(&first.displacement, &at(0.04 * share)), "{seconds}");
        assert!(is_same(&first.displacement.compose(&second.displacement), &motion.displacement), "{seconds}");
        for (part, share) in [(first, share), (second, 1.0 - share)] {
            assert!((part.covariance - motion.covariance * share).norm() < 1e-18);
            assert!((part.distance - 0.05 * share).abs() < 1e-15);
        }
    }
    // An interval of no length is all before.
    let nothing = Motion { end: motion.start, ..motion };
    let (first, second) = nothing.split(motion.start);
    assert!(is_same(&first.displacement, &motion.displacement) && is_same(&second.displacement, &Pose::default()));
    assert_eq!((first.distance, second.distance), (0.05, 0.0));
    assert_eq!((first.covariance, second.covariance), (motion.covariance, Matrix3::zeros()));
}

#[test]
fn a_wrong_assumption_is_made_up_for_by_the_rest() {
    let (motion, _) = arc();
    let assumed = Pose::new(0.02, -0.01, 0.1);
    let rest = motion.remainder(&assumed, time(1_010_000));
    assert!(is_same(&assumed.compose(&rest.displacement), &motion.displacement));
    assert_eq!((rest.start, rest.end), (time(1_010_000), motion.end));
    assert!((rest.distance - 0.0375).abs() < 1e-15 && (rest.covariance - motion.covariance * 0.75).norm() < 1e-18);
}

#[test]
fn who_coasts_keeps_the_velocity_with_the_doubt_of_an_unknown_acceleration() {
    let (believed, at) = arc();
    let mut coasting = Coasting::new(believed);
    assert!(coasting.to(believed.end, &UNKNOWN).is_none() && coasting.to(time(1), &UNKNOWN).is_none());
    let mut pose = Pose::default();
    let (mut doubt, mut distance, mut until) = (Matrix3::zeros(), 0.0, believed.end);
    for micros in [10_000, 90_000, 100_000, 1_500_000] {
        let now = time(1_040_000 + micros);
        let seconds = micros as f64 * 1e-6;
        assert!(coasting.to(now, &UNKNOWN).is_some_and(|motion| {
            assert_eq!((motion.start, motion.end), (until, now));
            pose = pose.compose(&motion.displacement);
            doubt += motion.covariance;
            distance += motion.distance;
            true
        }));
        assert!(coasting.to(now, &UNKNOWN).is_none());
        until = now;
        assert!(is_same(&pose, &at(seconds)), "{seconds}");
        assert!((distance - 0.05 / 0.04 * seconds).abs() < 1e-12);
        // The way of an acceleration after t is a t^2 / 2.
        let of_way = (1.5 * seconds * seconds / 2.0).powi(2);
        let of_turn = (0.7 * seconds * seconds / 2.0).powi(2);
        let expected = believed.covariance * (seconds / 0.04) + Matrix3::from_diagonal(&[of_way, 0.0, of_turn].into());
        assert!((doubt - expected).norm() < 1e-12 * expected.norm().max(1e-3), "{seconds} {doubt} {expected}");
    }
    // Standing, it stays; and after a long time the doubt has no end that overflows.
    let mut coasting = Coasting::new(Motion::none(time(0)));
    let moved = coasting.to(time(u64::MAX), &UNKNOWN);
    assert!(moved.is_some_and(|motion| {
        let longest = (1.5_f64 * 1e6 / 2.0).powi(2);
        motion.displacement == Pose::default() && (motion.covariance.m11 / longest - 1.0).abs() < 1e-12
    }));
}

/// After the pose was corrected `c` seconds on, the distance since has the error `a (t^2 - c^2) / 2` of one acceleration.
#[test]
fn who_coasts_from_a_corrected_pose_has_the_doubt_of_the_velocity_alone() {
    let believed = Motion { covariance: Matrix3::zeros(), ..Motion::none(time(1_000_000)) };
    let mut coasting = Coasting::new(believed);
    let at = |seconds: f64| time(1_000_000 + (1e6 * seconds) as u64);
    assert!(coasting.to(at(0.5), &UNKNOWN).is_some());
    coasting.correct(at(0.5));
    let mut doubt = Matrix3::zeros();
    for seconds in [0.6, 0.75, 1.0] {
        doubt += coasting.to(at(seconds), &UNKNOWN).map_or(Matrix3::zeros(), |motion| motion.covariance);
        let way = (seconds * seconds - 0.25) / 2.0;
        let expected = Matrix3::from_diagonal(&[(1.5 * way).powi(2), 0.0, (0.7 * way).powi(2)].into());
        assert!((doubt - expected).norm() < 1e-12, "{seconds} {doubt} {expected}");
    }
}

/// Two corrected poses tell the mean velocity between them, which the vehicle had in the middle; a worse one is not taken.
#[test]
fn corrected_poses_tell_the_velocity_of_who_coasts() {
    let at = |seconds: f64| time(1_000_000 + (1e6 * seconds) as u64);
    for (deviation, is_taken) in [(0.002, true), (0.2, false)] {
        let mut coasting = Coasting::new(Motion::none(at(0.0)));
        assert!(coasting.to(at(0.5), &UNKNOWN).is_some());
        let seen = Motion {
            start: at(0.4),
            end: at(0.5),
            displacement: Pose::new(0.03, 0.0, 0.01),
            covariance: Matrix3::from_diagonal_element(deviation * deviation),
            distance: 0.03,
        };
        coasting.correct_velocity(&seen, &UNKNOWN);
        let Some(motion) = coasting.to(at(0.6), &UNKNOWN) else { panic!("it goes on") };
        let way = if is_taken { 0.03 } else { 0.0 };
        assert!((motion.displacement.x - way).abs() < 1e-12, "{motion:?}");
        // Since the middle, a twentieth of a second before the correction; or since the odometry was believed.
        let since = if is_taken { (0.15_f64, 0.05_f64) } else { (0.6, 0.5) };
        let growth = 1.5 * (since.0 * since.0 - since.1 * since.1) / 2.0;
        let own = if is_taken { deviation * deviation } else { 0.0 };
        assert!((motion.covariance.m11 - own - growth * growth).abs() < 1e-12, "{motion:?}");
    }
}

#[test]
fn a_known_bias_is_taken_from_the_motion_as_the_wheel_would_have_made_it() {
    for vehicle in [TRICYCLE, CAR] {
        let wheelbase = match vehicle {
            Vehicle::Tricycle(tricycle) => tricycle.wheelbase,
            Vehicle::Ackermann(car) => car.wheelbase,
            Vehicle::TricycleSpeed(tricycle) => tricycle.wheelbase,
            Vehicle::Increments | Vehicle::Wheels(_) => 1.0,
        };
        for steering in [-0.4, 0.0, 0.3] {
            let control = |scale: f64, shift: f64| {
                let angle = steering + shift;
                let wheel = Control { distance: 0.01 * scale, steering_start: angle, steering_end: angle };
                wheel.displacement(wheelbase, Integration::Arc)
            };
            let bias = OdometryBias { scale: 0.004, steering: 0.003 };
            let reported = Motion { displacement: control(1.0, 0.0), ..arc().0 };
            let told = reported.corrected(&bias, vehicle.steering_lever());
            let expected = control(1.004, 0.003);
            let off = told.displacement.between(&expected);
            // Both effects together, and the arc, are of second order.
            assert!(off.x.abs() < 1e-6 && off.y.abs() < 1e-7 && off.theta.abs() < 1e-6, "{steering} {off:?}");
            let was = reported.displacement.between(&expected);
            assert!(was.x.hypot(was.theta) > 1e-5, "the bias is more than what is allowed");
            assert_eq!(Motion { displacement: reported.displacement, ..told }, reported);
        }
    }
}

#[test]
fn a_speed_that_changes_counts_by_its_mean() {
    let sample = |micros, speed, steering| SpeedSample { time: time(micros), speed, steering };
    let mut car = odometer(CAR, 100.0);
    assert_eq!(car.speed(&sample(0, 1.0, 0.2)), Err(OdometryError::First));
    let motion = car.speed(&sample(100_000, 3.0, 0.3));
    // The wheel with the sensor goes round a smaller circle than the virtual one in front.
    let front = |speed: f64, steering: f64| speed / (steering.cos() - steering.sin() * 0.76 / 2.83);
    let control =
        Control { distance: 0.1 * 0.5 * (front(1.0, 0.2) + front(3.0, 0.3)), steering_start: 0.2, steering_end: 0.3 };
    assert!(motion.is_ok_and(|motion| {
        assert!(is_same(&motion.displacement, &control.displacement(2.83, Integration::Arc)));
        assert!((motion.distance - control.distance).abs() < 1e-12);
        assert_eq!((motion.start, motion.end), (time(0), time(100_000)));
        assert!((motion.covariance - NOISE.of_control(&control, 2.83, 0.1)).norm() < 1e-15);
        true
    }));
    assert_eq!(car.speed(&sample(100_000, 3.0, 0.3)), Err(OdometryError::OutOfOrder));
    for (speed, steering) in
        [(f64::NAN, 0.0), (f64::INFINITY, 0.0), (1.0, FRAC_PI_2), (1.0, -FRAC_PI_2), (1.0, f64::NAN)]
    {
        assert_eq!(car.speed(&sample(150_000, speed, steering)), Err(OdometryError::Implausible), "{speed} {steering}");
    }
    assert!(car.speed(&sample(200_000, 3.0, -1.5)).is_ok());
    car.restart();
    assert_eq!(car.speed(&sample(300_000, 3.0, 0.3)), Err(OdometryError::First));
}

#[test]
fn an_increment_is_taken_as_it_is_if_the_vehicle_can_be_so_fast() {
    let increment = |micros, x, y, theta| PoseIncrement { time: time(micros), displacement: Pose { x, y, theta } };
    let mut vehicle = odometer(Vehicle::Increments, 2.01);
    assert_eq!(vehicle.increment(&increment(0, 0.0, 0.0, 0.0)), Err(OdometryError::First));
    let told = vehicle.increment(&increment(100_000, 0.12, -0.16, 3.1));
    assert!(told.is_ok_and(|motion| {
        assert_eq!(motion.displacement, Pose::new(0.12, -0.16, 3.1));
        assert_eq!((motion.start, motion.end), (time(0), time(100_000)));
        assert!((motion.distance - 0.2).abs() < 1e-15);
        assert!((motion.covariance - NOISE.of_displacement(0.2, 3.1, 0.1)).norm() < 1e-15);
        true
    }));
    assert_eq!(vehicle.increment(&increment(100_000, 0.0, 0.0, 0.0)), Err(OdometryError::OutOfOrder));
    assert_eq!(vehicle.increment(&increment(50_000, 0.0, 0.0, 0.0)), Err(OdometryError::OutOfOrder));
    // So much in two tenths of a second, of which the times may be off by half a tenth each; and no more in the next one.
    assert_eq!(vehicle.increment(&increment(200_000, 0.25, -0.322, 0.0)), Err(OdometryError::Implausible));
    assert_eq!(vehicle.increment(&increment(300_000, 0.1, f64::NAN, 0.0)), Err(OdometryError::Implausible));
    // What was refused in its order has not moved the start of the next.
    assert!(vehicle.increment(&increment(400_000, 0.1, 0.0, 0.0)).is_ok_and(|motion| motion.start == time(300_000)));
}

#[test]
fn the_fastest_motion_is_still_possible() {
    let mut vehicle = odometer(Vehicle::Increments, 2.0);
    let mut car = odometer(CAR, 2.0);
    let mut answers = Vec::new();
    for (micros, speed) in [(0, 2.0), (500_000, 2.0), (1_000_000, 4.001)] {
        let displacement = Pose::new(0.5 * speed, 0.0, 0.0);
        let by_increment = vehicle.increment(&PoseIncrement { time: time(micros), displacement });
        let by_speed = car.speed(&SpeedSample { time: time(micros), speed, steering: 0.0 });
        answers.push([by_increment.err(), by_speed.err()]);
    }
    let expected = [Some(OdometryError::First), None, Some(OdometryError::Implausible)];
    assert_eq!(answers, expected.map(|answer| [answer; 2]));
}

/// A step may hold more than its time, as times are off; all steps together may not.
#[test]
fn a_vehicle_that_is_too_fast_all_the_time_is_refused() {
    for (speed, is_refused) in [(1.99, false), (2.2, true), (3.0, true)] {
        let mut vehicle = odometer(Vehicle::Increments, 2.0);
        let steps = (0..100_u64).map(|number| {
            let displacement = Pose::new(0.01 * speed, 0.0, 0.0);
            vehicle.increment(&PoseIncrement { time: time(10_000 * number), displacement })
        });
        let refused = steps.filter(|step| *step == Err(OdometryError::Implausible)).count();
        assert_eq!(refused > 0, is_refused, "{speed} m/s: {refused}");
    }
}

#[test]
fn counters_read_around_zero() {
    let range = CounterRange::BITS_16;
    assert_eq!([0, 1, 32_767, 32_768, 65_535].map(|reading| range.signed(reading)), [0, 1, 32_767, -32_768, -1]);
    assert_eq!([0, 65_536, -1, 131_075].map(|position| range.wrap(position)), [0, 0, 65_535, 3]);
    let odd = CounterRange::new(5);
    assert_eq!(odd.map(|odd| [0, 1, 2, 3, 4].map(|reading| odd.signed(reading))), Some([0, 1, 2, -2, -1]));
    assert_eq!([0, 1, (1 << 32) + 1].map(CounterRange::new), [None; 3]);
    assert_eq!(
        [2, 1 << 32].map(|values| CounterRange::new(values).map(CounterRange::values)),
        [Some(2), Some(1 << 32)]
    );
}

//! Counters, integration and control noise, against closed forms and finite differences.
#![allow(
    clippy::indexing_slicing,
    clippy::needless_range_loop,
    clippy::unwrap_used,
    reason = "a panic is how a test fails"
)]

use agv_core::filter::Ekf;
use agv_core::geometry::{Pose, Twist, difference};
use agv_core::measurement::{EncoderSample, PoseIncrement, SpeedSample, Time, WheelReading, WheelSample};
use agv_core::odometry::{
    Ackermann, AngleEncoder, Believed, Control, CounterRange, Differential, DrivenWheel, Increments, Integration,
    Kinematics, Motion, OdometerParameters, OdometryBias, OdometryError, OdometryNoise, RecentMotion, Tricycle,
    Vehicle, VehicleOdometer,
};
use nalgebra::Matrix3;
use proptest::prelude::*;

const WHEELBASE: f64 = 1.5;

proptest! {
    #[test]
    fn counters_of_any_range_find_the_shortest_step(
        values in prop_oneof![Just(1u64 << 16), Just(1 << 24), Just(1 << 32), 2u64..=1 << 32],
        from in any::<u64>(),
        step in any::<i64>(),
    ) {
        let range = CounterRange::new(values).unwrap();
        let half = (values / 2) as i64;
        let step = step.rem_euclid(values as i64) - half;
        let from = from % values;
        let to = (from as i64 + step).rem_euclid(values as i64) as u32;
        prop_assert_eq!(range.step(from as u32, to), step);
    }

    /// Ranges come from records and files, too.
    #[test]
    fn a_range_that_no_counter_has_is_read_from_nowhere(values in prop_oneof![0_u64..4, any::<u32>().prop_map(u64::from), (1_u64 << 32) - 2..=(1 << 32) + 2, any::<u64>()]) {
        let mut room = [0; 16];
        let bytes = postcard::to_slice(&values, &mut room).unwrap();
        let read = postcard::from_bytes::<CounterRange>(bytes).ok();
        prop_assert_eq!(read, CounterRange::new(values));
        prop_assert_eq!(read.is_some(), (2..=1 << 32).contains(&values));
        if let Some(range) = read {
            let mut again = [0; 16];
            prop_assert_eq!(&*bytes, &*postcard::to_slice(&range, &mut again).unwrap());
        }
    }

    #[test]
    fn the_control_jacobian_is_a_finite_difference(
        distance in -0.5f64..0.5, start in -1.2f64..1.2, change in -0.1f64..0.1,
    ) {
        let control = |distance: f64, shift: f64| Control {
            distance,
            steering_start: start + shift,
            steering_end: start + change + shift,
        };
        let jacobian = control(distance, 0.0).jacobian(WHEELBASE);
        let step = 1e-6;
        let at = |distance: f64, shift: f64| {
            let end = control(distance, shift).displacement(WHEELBASE, Integration::RungeKutta2);
            [end.x, end.y, end.theta]
        };
        let by_distance = (at(distance + step, 0.0), at(distance - step, 0.0));
        let by_steering = (at(distance, step), at(distance, -step));
        for (column, (above, below)) in [by_distance, by_steering].into_iter().enumerate() {
            for row in 0..3 {
                let slope = (above[row] - below[row]) / (2.0 * step);
                prop_assert!((jacobian[(row, column)] - slope).abs() < 1e-8);
            }
        }
    }

    #[test]
    fn all_integrations_agree_on_straight_motion(distance in -2.0f64..2.0) {
        let control = Control { distance, steering_start: 0.0, steering_end: 0.0 };
        for integration in [Integration::RungeKutta2, Integration::Arc, Integration::RungeKutta4] {
            let end = control.displacement(WHEELBASE, integration);
            prop_assert!((end.x - distance).abs() < 1e-15 && end.y == 0.0 && end.theta == 0.0);
        }
    }

    #[test]
    fn a_motion_split_anywhere_adds_up(distance in -0.3f64..0.3, steering in -1.0f64..1.0, micros in 0u64..10_000) {
        let mut odometer = tricycle_odometer();
        let ticks = (distance / 1e-4) as i64;
        let sample = |time, drive: i64| EncoderSample {
            time: Time::from_micros(time),
            drive: drive as u32,
            steering: (steering / 1e-3) as i64 as u32 & 0xFFFF,
        };
        prop_assert_eq!(odometer.encoders(&sample(0, 0)), Err(OdometryError::First));
        let motion = odometer.encoders(&sample(10_000, ticks)).unwrap();
        let (first, second) = motion.split(Time::from_micros(micros));
        let end = first.displacement.compose(&second.displacement);
        prop_assert!(same(&end, &motion.displacement, 1e-14));
        prop_assert!(((first.covariance + second.covariance) - motion.covariance).norm() < 1e-15);
        prop_assert_eq!((first.start, first.end, second.end), (motion.start, second.start, motion.end));
        // Where an extrapolation has guessed wrongly, the remainder still leads to the same end.
        let guess = Pose::new(0.01, -0.002, 0.003);
        let rest = motion.remainder(&guess, Time::from_micros(micros));
        prop_assert!(same(&guess.compose(&rest.displacement), &motion.displacement, 1e-14));
    }
}

proptest! {
    #[test]
    fn two_motions_as_one_lead_a_filter_to_the_same_state(
        x in -0.1f64..0.1, turn in -0.3f64..0.3, next in -0.1f64..0.1, next_turn in -0.3f64..0.3, heading in -3.0f64..3.0,
    ) {
        let motion = |start: u64, x: f64, turn: f64| Motion {
            start: Time::from_micros(start),
            end: Time::from_micros(start + 10_000),
            displacement: Pose::new(x, 0.3 * x, turn),
            covariance: Matrix3::new(2e-6, 1e-7, 3e-7, 1e-7, 1e-6, 2e-7, 3e-7, 2e-7, 4e-6),
            distance: x.abs(),
        };
        let (first, second) = (motion(0, x, turn), motion(10_000, next, next_turn));
        let start = Ekf::new(Pose::new(1.0, -2.0, heading), 0.02, 0.01);
        let (mut apart, mut together) = (start, start);
        apart.predict(&first);
        apart.predict(&second);
        let both = first.then(&second);
        together.predict(&both);
        prop_assert!(same(&apart.pose, &together.pose, 1e-12));
        prop_assert!((apart.covariance() - together.covariance()).norm() < 1e-12);
        prop_assert_eq!((both.start, both.end), (first.start, second.end));
        prop_assert!((both.distance - x.abs() - next.abs()).abs() < 1e-15);
    }
}

fn same(a: &Pose, b: &Pose, tolerance: f64) -> bool {
    (a.x - b.x).abs() < tolerance && (a.y - b.y).abs() < tolerance && difference(a.theta, b.theta).abs() < tolerance
}

fn tricycle() -> Tricycle {
    Tricycle {
        wheelbase: WHEELBASE,
        drive_scale: 1e-4,
        drive_range: CounterRange::BITS_32,
        steering_scale: 1e-3,
        steering_range: CounterRange::BITS_16,
        steering_offset_forward: 0.0,
        steering_offset_backward: 0.0,
    }
}

fn tricycle_odometer() -> VehicleOdometer {
    VehicleOdometer::new(
        &Vehicle::Tricycle(tricycle()),
        &OdometerParameters {
            noise: OdometryNoise::default(),
            integration: Integration::RungeKutta2,
            fastest: 100.0,
            longest_interval: 0.25,
        },
    )
}

#[test]
fn a_range_that_no_counter_has_is_refused_with_the_ranges_that_counters_have() {
    for values in [0, 1, (1 << 32) + 1] {
        let error = CounterRange::try_from(values).unwrap_err();
        assert_eq!(error.to_string(), "a counter takes 2 to 2^32 values");
    }
}

/// Error of the end pose after a drive of 2 m whose steering angle is `rate * way`, in `steps` steps, against the
/// integral of the same drive in a million steps of the midpoint rule.
fn error_of(integration: Integration, steps: usize, rate: f64) -> f64 {
    let drive = |steps: usize, integration: Integration| {
        (0..steps).fold(Pose::default(), |pose, step| {
            let way = |step: usize| 2.0 * step as f64 / steps as f64;
            let control = Control {
                distance: 2.0 / steps as f64,
                steering_start: rate * way(step),
                steering_end: rate * way(step + 1),
            };
            pose.compose(&control.displacement(WHEELBASE, integration))
        })
    };
    let mut truth = (0.0, 0.0, 0.0f64);
    let fine = 1_000_000;
    let ds = 2.0 / fine as f64;
    for step in 0..fine {
        let steering = rate * (step as f64 + 0.5) * ds;
        let middle = truth.2 + 0.5 * ds / WHEELBASE * steering.sin();
        truth.0 += ds * steering.cos() * middle.cos();
        truth.1 += ds * steering.cos() * middle.sin();
        truth.2 += ds / WHEELBASE * steering.sin();
    }
    let end = drive(steps, integration);
    (end.x - truth.0).hypot(end.y - truth.1)
}

#[test]
fn integrations_converge_with_their_order() {
    for (integration, order) in
        [(Integration::RungeKutta2, 2.0), (Integration::Arc, 2.0), (Integration::RungeKutta4, 4.0)]
    {
        let measured = (error_of(integration, 8, 0.5) / error_of(integration, 16, 0.5)).log2();
        assert!((measured - order).abs() < 0.25, "{integration:?} has order {measured:.2}");
    }
}

#[test]
fn an_arc_of_constant_steering_is_exact() {
    // K 2.8, 2.9: radius L / tan(alpha).
    let steering: f64 = 0.6;
    let control = Control { distance: 1.2, steering_start: steering, steering_end: steering };
    let end = control.displacement(WHEELBASE, Integration::Arc);
    let turned = 1.2 * steering.sin() / WHEELBASE;
    let radius = WHEELBASE / steering.tan();
    let expected = Pose::new(radius * turned.sin(), radius * (1.0 - turned.cos()), turned);
    assert!(same(&end, &expected, 1e-14));
}

#[test]
fn the_asymmetric_model_uses_the_offset_of_the_direction() {
    let asymmetric = Tricycle { steering_offset_forward: 0.01, steering_offset_backward: -0.02, ..tricycle() };
    let mut odometer = VehicleOdometer::new(
        &Vehicle::Tricycle(asymmetric),
        &OdometerParameters {
            noise: OdometryNoise::default(),
            integration: Integration::Arc,
            fastest: 100.0,
            longest_interval: 0.25,
        },
    );
    let sample = |time, drive: u32| EncoderSample { time: Time::from_micros(time), drive, steering: 0 };
    assert_eq!(odometer.encoders(&sample(0, 0)), Err(OdometryError::First));
    let forward = odometer.encoders(&sample(100_000, 10_000)).unwrap();
    let backward = odometer.encoders(&sample(200_000, 0)).unwrap();
    assert!((forward.displacement.theta - 0.01f64.sin() / WHEELBASE).abs() < 1e-15);
    assert!((backward.displacement.theta - 0.02f64.sin() / WHEELBASE).abs() < 1e-15);
}

/// An encoder that was mounted half a turn round passes the end of its range when the wheel passes straight ahead.
#[test]
fn an_encoder_that_is_mounted_half_a_turn_round_tells_the_same() {
    let straight_at_zero = Tricycle {
        steering_scale: std::f64::consts::TAU / 4096.0,
        steering_range: CounterRange::new(4096).unwrap(),
        ..tricycle()
    };
    let half_a_turn = std::f64::consts::PI;
    let turned =
        Tricycle { steering_offset_forward: half_a_turn, steering_offset_backward: half_a_turn, ..straight_at_zero };
    let motions = |tricycle: Tricycle, zero: i64| {
        let mut odometer = VehicleOdometer::new(
            &Vehicle::Tricycle(tricycle),
            &OdometerParameters {
                noise: OdometryNoise::default(),
                integration: Integration::RungeKutta2,
                fastest: 100.0,
                longest_interval: 0.25,
            },
        );
        let readings = [-40_i64, -3, 2, 45, 1, -2, -30];
        let samples = (0_u32..).zip(readings).map(|(number, reading)| EncoderSample {
            time: Time::from_micros(100_000 * u64::from(number)),
            drive: 1000 * number,
            steering: (reading + zero).rem_euclid(4096) as u32,
        });
        samples.filter_map(|sample| odometer.encoders(&sample).ok()).collect::<Vec<Motion>>()
    };
    let (expected, found) = (motions(straight_at_zero, 0), motions(turned, 2048));
    assert_eq!(found.len(), 6);
    for (found, expected) in found.iter().zip(&expected) {
        assert!(same(&found.displacement, &expected.displacement, 1e-12), "{found:?} {expected:?}");
        assert!((found.covariance - expected.covariance).norm() < 1e-12 * expected.covariance.norm());
    }
}

#[test]
fn a_counter_that_counts_the_wrong_way_has_the_offset_of_the_same_direction() {
    let right = Tricycle { steering_offset_forward: 0.01, steering_offset_backward: -0.02, ..tricycle() };
    let wrong = Tricycle { drive_scale: -right.drive_scale, ..right };
    let motions = |tricycle: Tricycle, counts: [u32; 3]| {
        let mut odometer = VehicleOdometer::new(
            &Vehicle::Tricycle(tricycle),
            &OdometerParameters {
                noise: OdometryNoise::default(),
                integration: Integration::Arc,
                fastest: 100.0,
                longest_interval: 0.25,
            },
        );
        let samples = counts.into_iter().zip(0_u64..);
        let told = samples.map(|(drive, number)| EncoderSample {
            time: Time::from_micros(100_000 * number),
            drive,
            steering: 0,
        });
        told.filter_map(|sample| odometer.encoders(&sample).ok()).map(|motion| motion.displacement).collect::<Vec<_>>()
    };
    let forth_and_back = [100_000_u32, 110_000, 100_000];
    let opposite = forth_and_back.map(u32::wrapping_neg);
    assert_eq!(motions(wrong, opposite), motions(right, forth_and_back));
}

#[test]
fn a_drive_counter_that_wraps_goes_on() {
    let small = Tricycle { drive_range: CounterRange::new(5_000).unwrap(), ..tricycle() };
    let mut odometer = VehicleOdometer::new(
        &Vehicle::Tricycle(small),
        &OdometerParameters {
            noise: OdometryNoise::default(),
            integration: Integration::Arc,
            fastest: 20.0,
            longest_interval: 0.25,
        },
    );
    let mut way = 0.0;
    for step in 0u64..100 {
        let drive = (step * 700 % 5_000) as u32;
        let sample = EncoderSample { time: Time::from_micros(step * 10_000), drive, steering: 0 };
        if let Ok(motion) = odometer.encoders(&sample) {
            way += motion.displacement.x;
        }
    }
    assert!((way - 99.0 * 700.0 * 1e-4).abs() < 1e-12);
}

#[test]
fn a_car_turns_about_the_point_that_its_wheels_agree_on() {
    // Rear-left wheel at radius R - H, rear axle's centre at R = L / tan(steering).
    let car = Ackermann { wheelbase: 2.83, encoder_offset: 0.76 };
    let mut odometer = VehicleOdometer::new(
        &Vehicle::Ackermann(car),
        &OdometerParameters {
            noise: OdometryNoise::default(),
            integration: Integration::Arc,
            fastest: 100.0,
            longest_interval: 0.25,
        },
    );
    let steering: f64 = 0.3;
    let radius = 2.83 / steering.tan();
    let turn_rate = 0.4;
    let speed = turn_rate * (radius - 0.76);
    let sample = |time| SpeedSample { time: Time::from_micros(time), speed, steering };
    assert_eq!(odometer.speed(&sample(0)), Err(OdometryError::First));
    let motion = odometer.speed(&sample(200_000)).unwrap();
    let turned: f64 = 0.2 * turn_rate;
    let expected = Pose::new(radius * turned.sin(), radius * (1.0 - turned.cos()), turned);
    assert!(same(&motion.displacement, &expected, 1e-12));
}

/// A motion that the vehicle has integrated itself.
fn increment(displacement: Pose) -> Motion {
    let distance = displacement.position().norm();
    Motion { displacement, distance, ..Motion::none(Time::default()) }
}

#[test]
fn a_turn_that_is_not_reported_moves_no_vehicle_that_turns_in_place() {
    let bias = OdometryBias { scale: 0.0, steering: 4e-3 };
    let lever = Vehicle::Increments.steering_lever();
    let turn = increment(Pose::new(0.0, 0.0, std::f64::consts::TAU / 100.0));
    let mut pose = Pose::default();
    for _ in 0..100 {
        pose = pose.compose(&turn.corrected(&bias, lever).displacement);
        assert!(pose.position().norm() < 1e-12, "{} m from its place", pose.position().norm());
    }
    // On its way it turns by that much a metre more, forward and back.
    for (way, turn) in [(0.1, 0.0), (-0.1, 0.0), (0.02, 0.01), (-0.02, 0.01)] {
        let arc = |theta: f64| Pose::exp(&Twist { x: way, y: 0.0, theta });
        let corrected = increment(arc(turn)).corrected(&bias, lever).displacement;
        assert!(same(&corrected, &arc(turn + 4e-3 * way), 1e-6), "{corrected:?} for {way} m and {turn} rad");
    }
}

#[test]
fn only_increments_that_lead_back_are_backward() {
    let believed =
        Believed { noise: OdometryNoise::default(), integration: Integration::default(), was_backward: false };
    for (x, is_backward) in [(0.1, false), (0.0, false), (-0.1, true)] {
        let report = |micros, displacement| PoseIncrement { time: Time::from_micros(micros), displacement };
        let (from, to) = (report(0, Pose::default()), report(10_000, Pose::new(x, 0.0, 0.02)));
        assert_eq!(Increments.step(&from, &to, 0.01, &believed).is_backward, is_backward, "{x} m");
    }
}

#[test]
fn samples_that_cannot_be_are_refused() {
    let mut odometer = VehicleOdometer::new(
        &Vehicle::Tricycle(tricycle()),
        &OdometerParameters {
            noise: OdometryNoise::default(),
            integration: Integration::Arc,
            fastest: 2.0,
            longest_interval: 0.25,
        },
    );
    let sample = |time, drive: u32| EncoderSample { time: Time::from_micros(time), drive, steering: 0 };
    assert_eq!(odometer.encoders(&sample(100, 0)), Err(OdometryError::First));
    assert_eq!(odometer.encoders(&sample(100, 1)), Err(OdometryError::OutOfOrder));
    assert_eq!(odometer.encoders(&sample(10_100, 60_000)), Err(OdometryError::Implausible));
    assert!(odometer.encoders(&sample(20_100, 60_010)).is_ok());
    let speed = SpeedSample { time: Time::from_micros(0), speed: 1.0, steering: 0.0 };
    assert_eq!(odometer.speed(&speed), Err(OdometryError::WrongVehicle));
    let increment = PoseIncrement { time: Time::from_micros(0), displacement: Pose::default() };
    assert_eq!(odometer.increment(&increment), Err(OdometryError::WrongVehicle));
}

#[test]
fn samples_too_far_apart_make_no_motion_and_the_next_one_does() {
    let odometer = |vehicle| {
        VehicleOdometer::new(
            &vehicle,
            &OdometerParameters {
                noise: OdometryNoise::default(),
                integration: Integration::Arc,
                fastest: 5.0,
                longest_interval: 0.25,
            },
        )
    };
    let time = Time::from_micros;
    let mut encoders = odometer(Vehicle::Tricycle(tricycle()));
    let mut speeds = odometer(Vehicle::Ackermann(Ackermann { wheelbase: 2.0, encoder_offset: 0.0 }));
    let mut increments = odometer(Vehicle::Increments);
    let told = [0, 240_000, 5_240_000, 5_250_000].map(|micros| {
        let displacement = Pose::new(0.1, 0.0, 0.0);
        [
            encoders.encoders(&EncoderSample { time: time(micros), drive: micros as u32 / 1_000, steering: 0 }),
            speeds.speed(&SpeedSample { time: time(micros), speed: 1.0, steering: 0.1 }),
            increments.increment(&PoseIncrement { time: time(micros), displacement: displacement.fraction(0.1) }),
        ]
    });
    assert!(told[0].iter().all(|told| *told == Err(OdometryError::First)));
    assert!(told[1].iter().all(Result::is_ok));
    assert!(told[2].iter().all(|told| *told == Err(OdometryError::Pause)), "{:?}", told[2]);
    assert!(told[3].iter().all(|told| told.is_ok_and(|motion| motion.start == time(5_240_000))));
}

#[test]
fn a_counter_of_which_the_fastest_vehicle_may_go_half_the_range_is_not_believed() {
    // Half of 16 bits are 0.328 m, which 5 m/s are in 65.5 ms.
    let short = Tricycle { drive_scale: 1e-5, drive_range: CounterRange::BITS_16, ..tricycle() };
    for (micros, is_told) in [(60_000, true), (65_000, true), (66_000, false), (120_000, false)] {
        let mut odometer = VehicleOdometer::new(
            &Vehicle::Tricycle(short),
            &OdometerParameters {
                noise: OdometryNoise::default(),
                integration: Integration::Arc,
                fastest: 5.0,
                longest_interval: 0.25,
            },
        );
        let sample = |time, drive| EncoderSample { time: Time::from_micros(time), drive, steering: 0 };
        assert_eq!(odometer.encoders(&sample(0, 0)), Err(OdometryError::First));
        // The vehicle goes at 4.9 m/s.
        let drive = (micros as f64 * 4.9e-6 / 1e-5) as u32 & 0xFFFF;
        let told = odometer.encoders(&sample(micros, drive));
        assert_eq!(told.is_ok(), is_told, "{micros} us: {told:?}");
        if let Ok(motion) = told {
            assert!((motion.displacement.x - micros as f64 * 4.9e-6).abs() < 2e-5);
        }
    }
}

#[test]
fn the_stated_covariance_is_the_spread_of_noisy_controls() {
    // 20,000 draws of the controls, propagated through the integration itself.
    let noise =
        OdometryNoise { speed: 0.1, steering: 0.02, slip: 0.0, side_slip: 0.0, yaw: 0.0, ..OdometryNoise::default() };
    let control = Control { distance: 0.3, steering_start: 0.4, steering_end: 0.45 };
    let stated = noise.of_control(&control, WHEELBASE, 0.1);
    let mut state = 0x1234_5678_9ABC_DEF0u64;
    let mut uniform = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    let mut normal = || (0..12).map(|_| uniform()).sum::<f64>() - 6.0;
    let centre = control.displacement(WHEELBASE, Integration::RungeKutta2);
    let draws = 20_000;
    let mut spread = [[0.0; 3]; 3];
    for _ in 0..draws {
        let shift = 0.02 * normal();
        let noisy = Control {
            distance: control.distance + 0.1 * 0.1 * normal(),
            steering_start: control.steering_start + shift,
            steering_end: control.steering_end + shift,
        };
        let end = noisy.displacement(WHEELBASE, Integration::RungeKutta2);
        let error = [end.x - centre.x, end.y - centre.y, end.theta - centre.theta];
        for row in 0..3 {
            for column in 0..3 {
                spread[row][column] += error[row] * error[column] / f64::from(draws);
            }
        }
    }
    for row in 0..3 {
        for column in 0..3 {
            let scale = (stated[(row, row)] * stated[(column, column)]).sqrt();
            assert!((spread[row][column] - stated[(row, column)]).abs() < 0.05 * scale, "entry {row} {column}");
        }
    }
}

/// Speeds say how fast a vehicle was, whatever the time between two of them; counters only count so far.
#[test]
fn a_vehicle_that_tells_its_speed_may_be_silent_for_as_long_as_it_likes() {
    let car = Ackermann { wheelbase: WHEELBASE, encoder_offset: 0.4 };
    assert_eq!(car.longest_interval(5.0), f64::INFINITY);
    assert_eq!(Increments.longest_interval(5.0), f64::INFINITY);
}

#[test]
fn two_wheels_are_backward_if_their_middle_is_and_as_before_if_it_stands() {
    let turn = AngleEncoder { scale: 1e-3, range: CounterRange::BITS_16 };
    let wheel = DrivenWheel { radius: 0.1, turn };
    let vehicle = Differential { track: 0.6, left: wheel, right: wheel };
    let report = |micros, counts: [i32; 2]| {
        let count = |count: i32| WheelReading { count: count.rem_euclid(65_536) as u32, steering: 0 };
        let wheels = [count(counts[0]), count(counts[1]), WheelReading::default(), WheelReading::default()];
        WheelSample { time: Time::from_micros(micros), wheels }
    };
    for was_backward in [false, true] {
        let noise = OdometryNoise::default();
        let believed = Believed { noise, integration: Integration::default(), was_backward };
        for (counts, is_backward) in
            [([100, 100], false), ([-100, -100], true), ([-20, 100], false), ([20, -100], true), ([0, 0], was_backward)]
        {
            let step = vehicle.step(&report(0, [0, 0]), &report(10_000, counts), 0.01, &believed);
            assert_eq!(step.is_backward, is_backward, "{counts:?}, {was_backward} before");
        }
    }
}

/// The velocity between two samples is that of the last one to two tenths of a second, however the samples came.
#[test]
fn the_recent_motion_is_that_of_one_to_two_tenths_of_a_second() {
    let time = |milliseconds: u64| Time::from_micros(1000 * milliseconds);
    let mut recent = RecentMotion::standing(time(0));
    let at = |milliseconds: u64, x: f64| Motion {
        start: time(milliseconds),
        end: time(milliseconds + 10),
        displacement: Pose::new(x, 0.0, 0.0),
        distance: x,
        ..Motion::none(time(milliseconds))
    };
    // 1 m/s for half a second, then 2 m/s.
    for step in 0..80 {
        recent.add(&at(10 * step, if step < 50 { 0.01 } else { 0.02 }));
        let now = recent.end();
        assert_eq!(now, time(10 * step + 10));
        let passed = 0.01 * (step + 1) as f64;
        let speed = -recent.pose_at(now.offset(-0.01)).x / 0.01;
        match step {
            0..50 => assert!((speed - 1.0).abs() < 1e-9, "{passed}: {speed}"),
            70.. => assert!((speed - 2.0).abs() < 1e-9, "{passed}: {speed}"),
            _ => assert!((1.0..=2.0).contains(&speed), "{passed}: {speed}"),
        }
    }
    // What is further away than 0.32 s is taken for as far.
    assert_eq!(recent.pose_at(recent.end().offset(1.0)), recent.pose_at(recent.end().offset(0.32)));
    assert_eq!(recent.pose_at(recent.end().offset(-1.0)), recent.pose_at(recent.end().offset(-0.32)));
}

/// What a vehicle says of its direction: one that stands keeps that of the step before, where it can.
#[test]
fn a_step_says_which_way_it_went() {
    use agv_core::odometry::TricycleSpeed;
    let believed =
        |was_backward| Believed { noise: OdometryNoise::default(), integration: Integration::Arc, was_backward };
    let vehicle = TricycleSpeed { wheelbase: 1.2, steering_offset: 0.0 };
    for (speed, is_backward) in [(0.5, false), (-0.5, true), (0.0, false)] {
        let sample = |micros: u64| SpeedSample { time: Time::from_micros(micros), speed, steering: 0.1 };
        assert_eq!(
            vehicle.step(&sample(0), &sample(10_000), 0.01, &believed(false)).is_backward,
            is_backward,
            "{speed}"
        );
    }
    let tricycle = tricycle();
    let sample =
        |micros: u64, drive: i32| EncoderSample { time: Time::from_micros(micros), drive: drive as u32, steering: 0 };
    for (counts, was_backward, is_backward) in [
        (50, false, false),
        (50, true, false),
        (-50, false, true),
        (-50, true, true),
        (0, false, false),
        (0, true, true),
    ] {
        let step = tricycle.step(&sample(0, 0), &sample(10_000, counts), 0.01, &believed(was_backward));
        assert_eq!(step.is_backward, is_backward, "{counts}, {was_backward} before");
    }
}

/// A vehicle that reports its steps as they are.
#[derive(Clone, Copy, Debug)]
struct Told {
    step: agv_core::odometry::Step,
}

impl Kinematics for Told {
    type Report = Time;

    fn time(report: &Time) -> Time {
        *report
    }

    fn is_sound(&self, _: &Time) -> bool {
        true
    }

    fn step(&self, _: &Time, _: &Time, _: f64, _: &Believed) -> agv_core::odometry::Step {
        self.step
    }

    fn steering_lever(&self) -> Option<f64> {
        None
    }

    fn longest_interval(&self, _: f64) -> f64 {
        f64::INFINITY
    }

    fn resolution(&self) -> Option<f64> {
        None
    }
}

#[test]
fn a_step_of_which_a_part_is_no_number_is_implausible() {
    let sound = agv_core::odometry::Step { distance: 0.01, ..agv_core::odometry::Step::standing(false) };
    let mut no_place = sound;
    no_place.displacement.y = f64::NAN;
    let mut no_covariance = sound;
    no_covariance.covariance.m12 = f64::INFINITY;
    let no_distance = agv_core::odometry::Step { distance: f64::NAN, ..sound };
    let parameters = OdometerParameters {
        noise: OdometryNoise::default(),
        integration: Integration::default(),
        fastest: 5.0,
        longest_interval: 1.0,
    };
    for (step, is_sound) in [(sound, true), (no_place, false), (no_covariance, false), (no_distance, false)] {
        let mut odometer = agv_core::odometry::Odometer::new(Told { step }, &parameters);
        assert_eq!(odometer.report(&Time::from_micros(0)), Err(OdometryError::First));
        let found = odometer.report(&Time::from_micros(10_000));
        assert_eq!(found.err(), (!is_sound).then_some(OdometryError::Implausible), "{step:?}");
    }
}

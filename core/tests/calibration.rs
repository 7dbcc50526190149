//! The vehicle's parameters from segments, held against the drives that they were made from.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing, reason = "tests")]

use agv_core::calibration::{
    Calibration, Calibrator, Conditioning, MountingSide, Offsets, Problem, Registration, Segment, SegmentBuilder,
    Unobservable, calibrate, intrinsic_asymmetric, intrinsic_standard,
};
use agv_core::geometry::{Point, Pose};
use agv_core::odometry::{Control, CounterRange, Integration, Tricycle};
use proptest::prelude::*;

use super::support::reference_drive::reference_drive_bits;

#[derive(Clone, Copy, Debug)]
struct Truth {
    tricycle: Tricycle,
    laser: Pose,
}

fn tricycle(forward: f64, backward: f64, scale: f64, wheelbase: f64) -> Tricycle {
    Tricycle {
        wheelbase,
        drive_scale: scale,
        drive_range: CounterRange::BITS_32,
        steering_scale: 1e-5,
        steering_range: CounterRange::BITS_32,
        steering_offset_forward: forward,
        steering_offset_backward: backward,
    }
}

/// A segment of constant steering: the vehicle moves by the kinematics of odometry, in one step.
fn segment(truth: &Truth, steering: f64, ticks: f64) -> Segment {
    let vehicle = &truth.tricycle;
    let offset = if ticks < 0.0 { vehicle.steering_offset_backward } else { vehicle.steering_offset_forward };
    let angle = steering + offset;
    let control = Control { distance: vehicle.drive_scale * ticks, steering_start: angle, steering_end: angle };
    let moved = control.displacement(vehicle.wheelbase, Integration::Arc);
    let mut builder = SegmentBuilder::new(*vehicle);
    builder.add_step(ticks, steering, steering);
    builder.finish(&truth.laser.between(&moved.compose(&truth.laser)))
}

fn drive(truth: &Truth, angles: &[f64], turn: f64) -> Vec<Segment> {
    let mut segments = Vec::new();
    for direction in [1.0, -1.0] {
        for side in [1.0, -1.0] {
            for angle in angles {
                let ticks = turn * truth.tricycle.wheelbase / angle.sin() / truth.tricycle.drive_scale;
                segments.push(segment(truth, side * angle, (direction * ticks).round()));
            }
        }
    }
    segments
}

const PROBLEM: Problem =
    Problem { offsets: Offsets::ForEachSense, wheelbase: 1.5, is_wheelbase_free: false, side: None };
const ANGLES: [f64; 4] = [0.3, 0.5, 0.7, 0.87];

fn assert_found(found: &Calibration, truth: &Truth) {
    let vehicle = &truth.tricycle;
    let near = |name: &str, found: f64, truth: f64| {
        assert!((found - truth).abs() <= 1e-9 * truth.abs().max(1e-3), "{name}: {found} and not {truth}");
    };
    near("offset forward", found.intrinsic.offset_forward, vehicle.steering_offset_forward);
    near("offset backward", found.intrinsic.offset_backward, vehicle.steering_offset_backward);
    assert!((found.drive_scale() / vehicle.drive_scale - 1.0).abs() < 1e-9);
    near("laser x", found.extrinsic.laser.x, truth.laser.x);
    near("laser y", found.extrinsic.laser.y, truth.laser.y);
    near("laser heading", found.extrinsic.laser.theta, truth.laser.theta);
    near("wheelbase", found.extrinsic.wheelbase, vehicle.wheelbase);
}

#[test]
fn a_drive_without_noise_gives_its_parameters_back() {
    for (laser, side) in [
        (Pose::new(0.39, 0.002, 0.007), MountingSide::Front),
        (Pose::new(-0.8, 0.1, 3.0), MountingSide::Rear),
        (Pose::new(0.2, 0.7, 1.5), MountingSide::Left),
        (Pose::new(-0.2, -0.7, -1.5), MountingSide::Right),
        (Pose::new(1.49, -0.01, 0.04), MountingSide::Front),
    ] {
        let common = Truth { tricycle: tricycle(-0.0131, -0.0131, 0.25e-3, 1.5), laser };
        let problem = Problem { offsets: Offsets::Common, side: Some(side), ..PROBLEM };
        assert_found(&calibrate(&drive(&common, &ANGLES, 3.1), &problem).unwrap(), &common);
        let asymmetric = Truth { tricycle: tricycle(-0.0127, 0.0218, 0.25e-3, 1.5), laser };
        let problem = Problem { side: Some(side), ..PROBLEM };
        let segments = drive(&asymmetric, &ANGLES, 3.1);
        assert_found(&calibrate(&segments, &problem).unwrap(), &asymmetric);
        // The wheelbase is off by five per cent, and the laser's motion says so.
        let problem = Problem { wheelbase: 1.575, is_wheelbase_free: true, ..problem };
        let found = calibrate(&segments, &problem).unwrap();
        assert!((found.wheelbase - 1.5).abs() < 1e-9);
        assert_found(&found, &asymmetric);
    }
}

#[test]
fn straight_segments_are_as_good_as_any_other() {
    let truth = Truth { tricycle: tricycle(0.01, -0.02, 0.25e-3, 1.5), laser: Pose::new(0.4, 0.1, 0.1) };
    let mut segments = drive(&truth, &ANGLES, 1.0);
    segments.extend([segment(&truth, -0.01, 20_000.0), segment(&truth, 0.02, -20_000.0)]);
    assert_found(&calibrate(&segments, &PROBLEM).unwrap(), &truth);
}

#[test]
fn steering_may_change_within_a_segment() {
    // Two arcs a segment. The nominal vehicle is the true one, as after one round of calibration.
    let truth = Truth { tricycle: tricycle(0.01, -0.02, 0.25e-3, 1.5), laser: Pose::new(0.4, 0.1, 0.1) };
    let mut segments = Vec::new();
    for ticks in [9_000.0, -9_000.0] {
        for (first, second) in [(0.3, 0.8), (-0.3, -0.8), (0.6, -0.2), (0.5, 0.9)] {
            let mut builder = SegmentBuilder::new(truth.tricycle);
            let mut pose = Pose::default();
            for steering in [first, second] {
                builder.add_step(ticks, steering, steering);
                let vehicle = &truth.tricycle;
                let offset =
                    if ticks < 0.0 { vehicle.steering_offset_backward } else { vehicle.steering_offset_forward };
                let angle = steering + offset;
                let control = Control { distance: 0.25e-3 * ticks, steering_start: angle, steering_end: angle };
                pose = pose.compose(&control.displacement(1.5, Integration::Arc));
            }
            segments.push(builder.finish(&truth.laser.between(&pose.compose(&truth.laser))));
        }
    }
    assert!(segments.iter().all(|segment| segment.bend.norm() > 1e-3));
    assert_found(&calibrate(&segments, &PROBLEM).unwrap(), &truth);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 256, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_vehicle_is_found(
        forward in -0.3..0.3_f64, backward in -0.3..0.3_f64, scale in 1e-5..1e-2_f64, wheelbase in 0.5..4.0_f64,
        x in -3.0..3.0_f64, y in -2.0..2.0_f64, heading in -3.1..3.1_f64, turn in 0.3..4.5_f64,
    ) {
        let truth = Truth { tricycle: tricycle(forward, backward, scale, wheelbase), laser: Pose::new(x, y, heading) };
        let found = calibrate(&drive(&truth, &ANGLES, turn), &Problem { wheelbase, ..PROBLEM }).unwrap();
        prop_assert!((found.intrinsic.offset_forward - forward).abs() < 1e-9);
        prop_assert!((found.intrinsic.offset_backward - backward).abs() < 1e-9);
        prop_assert!((found.drive_scale() / scale - 1.0).abs() < 1e-9);
        prop_assert!((found.extrinsic.laser.x - x).abs() < 1e-8 * wheelbase.max(1.0));
        prop_assert!((found.extrinsic.laser.y - y).abs() < 1e-8 * wheelbase.max(1.0));
        prop_assert!((found.extrinsic.laser.theta - heading).abs() < 1e-8);
        prop_assert!(found.extrinsic.costs[0] <= found.extrinsic.costs[1]);
    }

    #[test]
    fn the_asymmetric_solution_is_the_best_one(stirs in prop::collection::vec(-0.02..0.02_f64, 16), seed in 0..64_u32) {
        // Independent truth: no step along any of the three parameters lowers the cost of the rotations.
        let truth = Truth { tricycle: tricycle(0.1, -0.05, 0.25e-3, 1.5), laser: Pose::default() };
        let mut segments = drive(&truth, &ANGLES, 1.0 + f64::from(seed) * 0.03);
        for (segment, stir) in segments.iter_mut().zip(&stirs) {
            segment.rotation += stir;
        }
        let found = intrinsic_asymmetric(&segments).unwrap();
        let cost = |steps: [f64; 3]| -> f64 {
            segments.iter().map(|segment| {
                let offset = if segment.cosine < 0.0 { found.offset_backward + steps[1] } else { found.offset_forward + steps[0] };
                let turned = found.turn_scale * (1.0 + steps[2])
                    * (segment.sine * offset.cos() + segment.cosine * offset.sin());
                (segment.rotation - turned).powi(2)
            }).sum()
        };
        let best = cost([0.0; 3]);
        for direction in 0..3 {
            for step in [1e-4, -1e-4] {
                let mut steps = [0.0; 3];
                steps[direction] = step;
                prop_assert!(cost(steps) > best, "a step of {step} along {direction} is better");
            }
        }
    }
}

#[test]
fn what_cannot_be_told_is_refused() {
    let truth = Truth { tricycle: tricycle(0.01, -0.02, 0.25e-3, 1.5), laser: Pose::new(0.4, 0.1, 0.1) };
    let good = drive(&truth, &ANGLES, 3.0);
    let refusal = |segments: &[Segment], problem: &Problem| calibrate(segments, problem).unwrap_err();
    let common = Problem { offsets: Offsets::Common, ..PROBLEM };
    assert_eq!(refusal(&[], &common), Unobservable::TooFewSegments);
    assert_eq!(refusal(&[], &PROBLEM), Unobservable::TooFewSegments);
    assert_eq!(refusal(&good[..1], &common), Unobservable::OneSteeringAngle);
    let one_angle = [segment(&truth, 0.4, 9000.0), segment(&truth, 0.4, 12000.0), segment(&truth, 0.4, 7000.0)];
    assert_eq!(refusal(&one_angle, &common), Unobservable::OneSteeringAngle);
    assert_eq!(refusal(&good[..8], &PROBLEM), Unobservable::OneSteeringAngleBackward);
    assert_eq!(refusal(&good[8..], &PROBLEM), Unobservable::OneSteeringAngleForward);
    let still = [segment(&truth, 0.4, 1.0), segment(&truth, -0.4, 1.0)];
    assert_eq!(refusal(&still, &common), Unobservable::NoMotion);
    let mut bad = good.clone();
    bad[3].rotation = f64::NAN;
    assert_eq!(refusal(&bad, &PROBLEM), Unobservable::NotFinite);
    let mut bad = good.clone();
    bad[3].sensor.x = f64::INFINITY;
    assert_eq!(refusal(&bad, &PROBLEM), Unobservable::NotFinite);
    let rear = Problem { side: Some(MountingSide::Rear), ..PROBLEM };
    assert_eq!(refusal(&good, &rear), Unobservable::WrongSide);
    // Two almost straight ways, one to each side.
    let straight: Vec<_> = [0.02, -0.02].map(|angle| segment(&truth, angle - 0.01, 2000.0)).to_vec();
    assert_eq!(refusal(&straight, &common), Unobservable::NoRotation);
}

#[test]
fn conditioning_is_that_of_the_thesis() {
    // K 2.41 for its own symmetric design, and the quotient of singular values of the matrix of equations.
    let truth = Truth { tricycle: tricycle(0.0, 0.0, 1e-7, 1.5), laser: Pose::default() };
    let segments = drive(&truth, &ANGLES, 3.0);
    let cotangents: f64 = ANGLES.iter().map(|angle| angle.tan().powi(-2)).sum();
    let printed = cotangents / ANGLES.len() as f64;
    let conditioning = Conditioning::of(&segments);
    assert!((conditioning.normal_equations / printed - 1.0).abs() < 1e-6);
    let rows: Vec<f64> = segments.iter().flat_map(|segment| [segment.sine, segment.cosine]).collect();
    let values = nalgebra::SMatrix::<f64, 16, 2>::from_row_slice(&rows).singular_values();
    assert!((conditioning.equations / (values.max() / values.min()) - 1.0).abs() < 1e-9);
}

#[test]
fn outlying_segments_are_named() {
    let truth = Truth { tricycle: tricycle(0.01, -0.02, 0.25e-3, 1.5), laser: Pose::new(0.4, 0.1, 0.1) };
    let mut calibrator = Calibrator::<32>::new(truth.tricycle);
    assert!(calibrator.stop(&Pose::default()).is_err());
    assert!(calibrator.segments().is_empty());
    let mut segments = drive(&truth, &ANGLES, 3.0);
    segments[5].rotation += 0.01;
    segments[12].sensor.x += 0.02;
    let (found, flags) = agv_core::calibration::outliers::<32>(&segments, &PROBLEM).unwrap();
    let named: Vec<usize> = (0..flags.len()).filter(|index| flags[*index]).collect();
    assert_eq!(named, [5, 12]);
    assert_found(&found, &truth);
}

#[test]
fn the_stated_covariance_is_the_spread() {
    // White errors of known size on the rotations; the spread over seeds against what each run states.
    let truth = Truth { tricycle: tricycle(0.01, -0.02, 0.25e-3, 1.5), laser: Pose::new(0.4, 0.1, 0.1) };
    let exact = drive(&truth, &ANGLES, 3.0);
    let mut state = 1_u64;
    let mut uniform = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    for offsets in [Offsets::Common, Offsets::ForEachSense] {
        let mut squares = [0.0; 6];
        let mut stated = [0.0; 6];
        let centre = calibrate(&exact, &Problem { offsets, ..PROBLEM }).unwrap();
        for _ in 0..400 {
            let mut segments = exact.clone();
            for segment in &mut segments {
                segment.rotation += 2e-3 * uniform();
                segment.sensor += Point::new(4e-3 * uniform(), 4e-3 * uniform());
            }
            let found = calibrate(&segments, &Problem { offsets, ..PROBLEM }).unwrap();
            let values = |found: &Calibration| {
                let (laser, intrinsic) = (found.extrinsic.laser, found.intrinsic);
                [
                    intrinsic.offset_forward,
                    intrinsic.offset_backward,
                    intrinsic.turn_scale,
                    laser.x,
                    laser.y,
                    laser.theta,
                ]
            };
            let deviations = [found.intrinsic.deviations(), found.extrinsic.deviations()];
            for index in 0..6 {
                squares[index] += (values(&found)[index] - values(&centre)[index]).powi(2);
                stated[index] += deviations[index / 3][index % 3].powi(2);
            }
        }
        // The common offset does not fit this vehicle, so its residuals are larger than the errors.
        let indices = if offsets == Offsets::Common { 3..3 } else { 0..6 };
        for index in indices {
            let quotient = (stated[index] / squares[index]).sqrt();
            assert!((0.75..1.33).contains(&quotient), "{offsets:?} {index}: {quotient}");
        }
    }
}

#[test]
fn registration_finds_the_motion() {
    let motion = Pose::new(1.2, -0.4, 2.8);
    let mut registration = Registration::default();
    assert!(registration.solve().is_none());
    for (x, y) in [(3.0, 1.0), (-2.0, 5.0), (0.5, -7.0), (8.0, 8.0)] {
        let second = Point::new(x, y);
        registration.add(&motion.transform(&second), &second);
    }
    let found = registration.solve().unwrap();
    assert!((found.pose.x - motion.x).abs() < 1e-12 && (found.pose.theta - motion.theta).abs() < 1e-12);
    assert!(found.deviation < 1e-6 && found.pairs == 4);
    let mut together = Registration::default();
    for _ in 0..3 {
        together.add(&Point::new(1.0, 1.0), &Point::new(2.0, 1.0));
    }
    assert!(together.solve().is_none());
}

#[test]
fn two_kibibytes_are_enough() {
    assert!(core::mem::size_of::<Calibrator>() <= 2048, "{} bytes", core::mem::size_of::<Calibrator>());
}

/// Standard and asymmetric results of the reference drive, as every machine must give them.
const REFERENCE_DRIVE: [u64; 16] = [
    0xbf8a_d506_b678_1a60,
    0xbf8a_d506_b678_1a60,
    0x3f30_5ee4_1c5f_ff32,
    0x3fd8_f592_a13b_0ae5,
    0x3f83_f3c2_14a8_4fdf,
    0x3f93_c6cc_c00a_7fd7,
    0x3ff8_000a_9c73_a753,
    0x3ff7_39e2_4857_65a5,
    0xbf8a_034d_fc89_5c29,
    0xbf8b_a6be_ca4a_3439,
    0x3f30_5ee4_325b_a7ca,
    0x3fd8_f54d_05d4_7bf5,
    0x3f84_8050_ad33_ffde,
    0x3f94_7b05_ad58_4527,
    0x3ff8_000a_3e45_2339,
    0x3ff7_39e2_4857_65a5,
];

#[test]
fn the_reference_drive_gives_the_same_bits_everywhere() {
    let bits = reference_drive_bits().unwrap();
    let numbers = bits.map(f64::from_bits);
    assert_eq!(bits, REFERENCE_DRIVE, "{numbers:?}");
    assert!((numbers[2] - 0.2498e-3).abs() < 1e-7 && (numbers[8] + 0.0127).abs() < 2e-4, "{numbers:?}");
    assert!((numbers[9] + 0.0135).abs() < 2e-4 && (numbers[11] - 0.39).abs() < 2e-3, "{numbers:?}");
}

#[test]
fn a_standard_solution_averages_both_offsets() {
    let truth = Truth { tricycle: tricycle(0.0100, 0.0102, 0.25e-3, 1.5), laser: Pose::default() };
    let found = intrinsic_standard(&drive(&truth, &ANGLES, 3.0)).unwrap();
    assert!((found.offset_forward - 0.0101).abs() < 2e-5, "{}", found.offset_forward);
}

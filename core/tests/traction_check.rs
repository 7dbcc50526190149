//! A wheel that slips is told by what landmarks put right; a vehicle in order, a knock of the laser and an odometry of another scale
//! are not.

use agv_core::geometry::Pose;
use agv_core::integrity::{Estimate, TractionCheck};
use agv_core::measurement::Time;
use nalgebra::Matrix3;

/// Way between two revolutions, m, and how long one lasts, s.
const STEP: f64 = 0.1;
const PERIOD: f64 = 0.125;
/// Noise of what is done and of what landmarks say of one axis: that of the way is stated as 6 mm for a root of a metre.
const PROCESS: f64 = 6e-3 * 0.316_227_766_016_837_94;
const MEASURED: f64 = 4e-3;

/// About normal: the sum of twelve even numbers has the variance one.
fn normal(state: &mut u64) -> f64 {
    let mut even = || {
        *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*state >> 11) as f64 / (1_u64 << 53) as f64
    };
    (0..12).map(|_| even()).sum::<f64>() - 6.0
}

/// A filter of the way along x in its own few lines, whose corrections the check is told. `wrong` gives what the wheels tell too much
/// from the way behind; gives the ways at which a slip was told, m.
fn told(length: f64, seed: u64, mut wrong: impl FnMut(f64) -> f64) -> Vec<f64> {
    let mut state = seed;
    let mut check = TractionCheck::new();
    let (mut truth, mut believed, mut odometry) = (0.0, 0.0, 0.0);
    let mut variance = 1e-5;
    let mut ways = Vec::new();
    let estimate = |pose: f64, odometry: f64, variance: f64, distance: f64| Estimate {
        pose: Pose::new(pose, 0.0, 0.0),
        odometry_pose: Pose::new(odometry, 0.0, 0.0),
        covariance: Matrix3::from_diagonal(&nalgebra::Vector3::new(variance, 1e-6, 1e-6)),
        is_sure: true,
        distance,
    };
    for revolution in 0..(length / STEP) as u32 {
        let moved = STEP + wrong(truth) + PROCESS * normal(&mut state);
        (truth, believed, odometry) = (truth + STEP, believed + moved, odometry + moved);
        variance += PROCESS * PROCESS;
        let before = estimate(believed, odometry, variance, STEP);
        let gain = variance / (variance + MEASURED * MEASURED);
        believed += gain * (truth + MEASURED * normal(&mut state) - believed);
        variance *= 1.0 - gain;
        let after = estimate(believed, odometry, variance, 0.0);
        let now = Time::from_seconds(f64::from(revolution) * PERIOD);
        check.correct(&before, &after, now);
        if check.slips(now) {
            ways.push(truth);
        }
    }
    ways
}

#[test]
fn a_slip_by_a_fifth_is_told_within_three_tenths_of_a_metre() {
    for seed in 1..=100 {
        for share in [0.2, -0.2] {
            let ways = told(8.0, seed, |way| if (5.0..6.2).contains(&way) { share * STEP } else { 0.0 });
            let first = ways.first().expect("it is told") - 5.0;
            // A revolution more than the way itself: the slip may begin behind the last one.
            assert!(first > 0.0 && first <= 0.3 + STEP, "seed {seed}, {share}: {first} m");
        }
    }
}

#[test]
fn a_vehicle_whose_noise_is_as_stated_is_not_told_to_slip_in_ten_kilometres() {
    assert_eq!(told(10_000.0, 7, |_| 0.0), Vec::<f64>::new());
}

#[test]
fn an_odometry_of_another_scale_is_no_slip() {
    assert_eq!(told(2000.0, 3, |_| 0.01 * STEP), Vec::<f64>::new());
}

/// What lasts is told by the check of the mounting.
#[test]
fn what_lasts_is_no_slip_for_long() {
    let ways = told(50.0, 5, |way| if way > 5.0 { 0.2 * STEP } else { 0.0 });
    let (first, last) = (ways.first().unwrap(), ways.last().unwrap());
    assert!(last - first < 3.0 / PERIOD * STEP + STEP, "from {first} m to {last} m");
}

#[test]
fn one_revolution_alone_tells_nothing() {
    let mut check = TractionCheck::new();
    let estimate = |x: f64, variance: f64, distance: f64| Estimate {
        pose: Pose::new(x, 0.0, 0.0),
        odometry_pose: Pose::default(),
        covariance: Matrix3::identity() * variance,
        is_sure: true,
        distance,
    };
    let now = Time::from_seconds(1.0);
    check.correct(&estimate(0.0, 2e-5, STEP), &estimate(-0.2, 1e-5, 0.0), now);
    assert!(!check.slips(now));
    check.correct(&estimate(0.0, 2e-5, STEP), &estimate(-0.2, 1e-5, 0.0), now);
    assert!(check.slips(now));
    // Nothing is known of what is behind a long way without landmarks.
    let mut check = TractionCheck::new();
    check.correct(&estimate(0.0, 2e-5, STEP), &estimate(-0.2, 1e-5, 0.0), now);
    check.correct(&estimate(0.0, 2e-5, 1.0), &estimate(-0.2, 1e-5, 0.0), now);
    check.correct(&estimate(0.0, 2e-5, STEP), &estimate(-0.2, 1e-5, 0.0), now);
    assert!(!check.slips(now));
}

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

/// An estimate that is sure, with that covariance, so far behind the last correction.
fn sure(pose: Pose, covariance: Matrix3<f64>, distance: f64) -> Estimate {
    Estimate { pose, odometry_pose: Pose::default(), covariance, is_sure: true, distance }
}

/// Corrections of a vehicle at a heading, each a way and what was put right along and in the heading, m and rad; the covariance shrinks by
/// the same each time. Whether a slip is told.
fn is_told(heading: f64, shrunk: &Matrix3<f64>, corrections: &[(f64, f64, f64)]) -> bool {
    let mut check = TractionCheck::new();
    let now = Time::from_seconds(1.0);
    for (way, along, turn) in corrections {
        let moved = Pose::new(along * heading.cos(), along * heading.sin(), heading + turn);
        let before = sure(Pose::new(0.0, 0.0, heading), Matrix3::identity() + shrunk, *way);
        check.correct(&before, &sure(moved, Matrix3::identity(), 0.0), now);
    }
    check.slips(now)
}

/// The variance of a correction along the way is u' P u, where u is the heading's unit vector.
#[test]
fn the_limit_along_is_that_of_the_variance_in_the_direction_of_the_heading() {
    let shrunk = Matrix3::new(4e-5, 1.5e-5, 0.0, 1.5e-5, 1e-5, 0.0, 0.0, 0.0, 1e-6);
    for heading in [0.0_f64, 0.6, 1.3, 2.4, -0.9] {
        let unit = nalgebra::Vector3::new(heading.cos(), heading.sin(), 0.0);
        let variance = unit.dot(&(shrunk * unit));
        // Two parts of a tenth of a metre: 2 a = 4.4 sqrt(2 variance) + 0.02 0.2 m.
        let limit = 0.5 * (4.4 * (2.0 * variance).sqrt() + 0.004);
        for sign in [1.0, -1.0] {
            let twice = |share: f64| [(0.1, sign * share * limit, 0.0); 2];
            assert!(!is_told(heading, &shrunk, &twice(0.99)), "below the limit at {heading}");
            assert!(is_told(heading, &shrunk, &twice(1.01)), "above the limit at {heading}");
        }
    }
}

#[test]
fn the_limit_of_the_heading_is_that_of_its_own_variance() {
    let shrunk = Matrix3::from_diagonal(&nalgebra::Vector3::new(1e-4, 1e-4, 2e-6));
    // 2 a = 4.4 sqrt(4e-6) + 0.01 0.2 rad.
    let limit = 0.5 * (4.4 * 2e-3 + 2e-3);
    for sign in [1.0, -1.0] {
        let twice = |share: f64| [(0.1, 0.0, sign * share * limit); 2];
        assert!(!is_told(0.4, &shrunk, &twice(0.99)));
        assert!(is_told(0.4, &shrunk, &twice(1.01)));
    }
}

/// A knock is put right once and to one side; a slip again and again to the same.
#[test]
fn corrections_of_both_signs_are_no_slip() {
    let shrunk = Matrix3::identity() * 1e-6;
    assert!(is_told(0.0, &shrunk, &[(0.1, 0.05, 0.0), (0.1, 0.05, 0.0)]));
    assert!(!is_told(0.0, &shrunk, &[(0.1, -0.01, 0.0), (0.1, 0.05, 0.0)]));
    assert!(is_told(0.0, &shrunk, &[(0.1, 0.0, 0.05), (0.1, 0.0, 0.05)]));
    assert!(!is_told(0.0, &shrunk, &[(0.1, 0.0, -0.01), (0.1, 0.0, 0.05)]));
    // One of another sign among three.
    assert!(!is_told(0.0, &shrunk, &[(0.1, 0.05, 0.0), (0.1, -0.001, 0.0), (0.1, 0.05, 0.0)]));
    assert!(!is_told(0.0, &shrunk, &[(0.1, 0.0, 0.05), (0.1, 0.0, -0.001), (0.1, 0.0, 0.05)]));
    // Nothing has no sign.
    assert!(!is_told(0.0, &shrunk, &[(0.1, 0.0, 0.0), (0.1, 0.05, 0.0)]));
    assert!(!is_told(0.0, &shrunk, &[(0.1, 0.0, 0.0), (0.1, 0.0, 0.05)]));
    // Along and heading have each their own sign.
    assert!(is_told(0.0, &shrunk, &[(0.1, 0.05, -0.001), (0.1, 0.05, 0.001)]));
    assert!(is_told(0.0, &shrunk, &[(0.1, 0.001, 0.05), (0.1, -0.001, 0.05)]));
}

#[test]
fn short_ways_are_one_part_and_long_ones_none_together() {
    let shrunk = Matrix3::identity() * 1e-6;
    // Less than 0.06 m: both corrections are of one part.
    assert!(!is_told(0.0, &shrunk, &[(0.02, 0.05, 0.0), (0.02, 0.05, 0.0)]));
    assert!(is_told(0.0, &shrunk, &[(0.07, 0.05, 0.0), (0.07, 0.05, 0.0)]));
    // At the limit they are two.
    assert!(is_told(0.0, &shrunk, &[(0.06, 0.05, 0.0), (0.06, 0.05, 0.0)]));
    // After 0.3 m without a correction what was before still counts, after more it does not.
    assert!(is_told(0.0, &shrunk, &[(0.1, 0.05, 0.0), (0.3, 0.1, 0.0)]));
    assert!(!is_told(0.0, &shrunk, &[(0.1, 0.05, 0.0), (0.31, 0.1, 0.0)]));
    // More than 0.5 m together.
    assert!(!is_told(0.0, &shrunk, &[(0.28, 0.2, 0.0), (0.28, 0.2, 0.0)]));
    assert!(is_told(0.0, &shrunk, &[(0.25, 0.2, 0.0), (0.25, 0.2, 0.0)]));
}

#[test]
fn what_was_put_right_while_unsure_tells_nothing() {
    let now = Time::from_seconds(1.0);
    let shrunk = Matrix3::identity() * 1e-6;
    let (before, after) = (
        sure(Pose::default(), Matrix3::identity() + shrunk, 0.1),
        sure(Pose::new(0.05, 0.0, 0.0), Matrix3::identity(), 0.0),
    );
    let mut check = TractionCheck::new();
    check.correct(&before, &after, now);
    check.correct(&Estimate { is_sure: false, ..before }, &after, now);
    check.correct(&before, &after, now);
    assert!(!check.slips(now));
    check.correct(&before, &after, now);
    assert!(check.slips(now));
}

/// Without noise the least share of the way decides alone, and is itself no slip.
#[test]
fn six_hundredths_of_the_way_are_no_slip_and_more_are() {
    let known = Matrix3::zeros();
    assert!(!is_told(0.0, &known, &[(0.1, 0.006, 0.0), (0.1, 0.006, 0.0)]));
    assert!(is_told(0.0, &known, &[(0.1, 0.00601, 0.0), (0.1, 0.00601, 0.0)]));
}

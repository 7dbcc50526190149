//! Angles and poses: the laws of the group, and closed forms.
#![allow(
    clippy::indexing_slicing,
    clippy::needless_range_loop,
    clippy::unwrap_used,
    reason = "a panic is how a test fails"
)]

use std::f64::consts::{PI, TAU};

use agv_core::geometry::{Point, Pose, ScanPoint, Twist, difference, sector, wrap};
use proptest::prelude::*;

fn pose() -> impl Strategy<Value = Pose> {
    (-100.0..100.0, -100.0..100.0, -PI..PI).prop_map(|(x, y, theta)| Pose::new(x, y, theta))
}

fn assert_same(a: &Pose, b: &Pose, tolerance: f64) {
    let error = (a.x - b.x).abs().max((a.y - b.y).abs()).max(difference(a.theta, b.theta).abs());
    assert!(error <= tolerance, "{a:?} is not {b:?}");
}

/// The definition: what is left of whole turns, brought into the interval.
fn wrapped_by_definition(angle: f64) -> f64 {
    let left = angle % TAU;
    if left > PI {
        left - TAU
    } else if left <= -PI {
        left + TAU
    } else {
        left
    }
}

#[test]
fn wrapping_is_exact_at_half_turns() {
    for turns in -9..=9 {
        for angle in [f64::from(turns) * PI, f64::from(turns) * PI + 1e-15, f64::from(turns) * PI - 1e-15] {
            assert_eq!(wrap(angle).to_bits(), wrapped_by_definition(angle).to_bits(), "{angle:?}");
        }
    }
    assert!(wrap(f64::NAN).is_nan() && wrap(f64::INFINITY).is_nan() && wrap(f64::NEG_INFINITY).is_nan());
}

#[test]
fn axes_and_points_without_a_direction_have_a_sector() {
    for (x, y, expected) in [(1.0, 0.0, 360), (0.0, 1.0, 540), (0.0, -1.0, 180), (-1.0, 0.0, 719), (-1.0, -0.0, 0)] {
        assert_eq!(sector(&ScanPoint::new(x, y), 720), expected, "{x}, {y}");
    }
    for (x, y) in [(0.0, 0.0), (f32::NAN, 1.0), (f32::INFINITY, f32::INFINITY), (1e-40, -1e-40), (f32::MAX, 1.0)] {
        assert!(sector(&ScanPoint::new(x, y), 720) < 720, "{x}, {y}");
    }
    assert_eq!(sector(&ScanPoint::new(1.0, 1.0), 0), 0);
}

proptest! {
    #[test]
    fn a_sector_holds_the_direction_of_its_points(
        (angle, distance) in (-PI..PI, 0.01..100.0),
        count in prop_oneof![1..20_usize, Just(360), Just(720), 500..4000_usize],
    ) {
        let point = ScanPoint::new((distance * angle.cos()) as f32, (distance * angle.sin()) as f32);
        let share = (f64::from(point.y).atan2(f64::from(point.x)) / TAU + 0.5) * count as f64;
        let found = sector(&point, count);
        prop_assert!(found < count);
        // By as much as single precision has it.
        let rounding = 3e-7 * count as f64;
        let (from, to) = (found as f64 - rounding, found as f64 + 1.0 + rounding);
        prop_assert!(from <= share && share <= to, "{} of {} has {}", found, count, share);
    }

    #[test]
    fn wrapping_is_exact(angle in any::<f64>()) {
        prop_assert_eq!(wrap(angle).to_bits(), wrapped_by_definition(angle).to_bits());
    }

    #[test]
    fn wrapping_of_some_turns_is_exact(angle in -1e3f64..1e3) {
        prop_assert_eq!(wrap(angle).to_bits(), wrapped_by_definition(angle).to_bits());
    }

    #[test]
    fn wrapping_keeps_the_direction(angle in -1e3f64..1e3) {
        let wrapped = wrap(angle);
        prop_assert!(wrapped > -PI && wrapped <= PI);
        prop_assert!((wrapped.sin() - angle.sin()).abs() < 1e-10);
        prop_assert!((wrapped.cos() - angle.cos()).abs() < 1e-10);
    }

    #[test]
    fn wrapping_ignores_whole_turns(angle in -3.0f64..3.0, turns in -20i32..20) {
        prop_assert!((wrap(angle + f64::from(turns) * TAU) - angle).abs() < 1e-12);
    }

    #[test]
    fn composition_is_associative(a in pose(), b in pose(), c in pose()) {
        assert_same(&a.compose(&b).compose(&c), &a.compose(&b.compose(&c)), 1e-10);
    }

    #[test]
    fn the_inverse_undoes(a in pose()) {
        assert_same(&a.compose(&a.inverse()), &Pose::default(), 1e-12);
        assert_same(&a.inverse().compose(&a), &Pose::default(), 1e-12);
    }

    #[test]
    fn between_leads_from_one_to_the_other(a in pose(), b in pose()) {
        assert_same(&a.compose(&a.between(&b)), &b, 1e-11);
    }

    #[test]
    fn points_transform_like_poses(a in pose(), b in pose()) {
        let point = a.transform(&b.position());
        prop_assert!((point - a.compose(&b).position()).norm() < 1e-12);
        prop_assert!((a.inverse_transform(&point) - b.position()).norm() < 1e-10);
    }

    #[test]
    fn the_logarithm_is_the_inverse_of_the_exponential(x in -5.0..5.0, y in -5.0..5.0, theta in -3.0..3.0) {
        let twist = Twist { x, y, theta };
        let back = Pose::exp(&twist).log();
        prop_assert!((back.x - x).abs() + (back.y - y).abs() + (back.theta - theta).abs() < 1e-10);
    }

    #[test]
    fn fractions_of_a_displacement_add_up(x in -5.0..5.0, y in -5.0..5.0, theta in -3.0..3.0, share in 0.0..1.0) {
        let whole = Pose::exp(&Twist { x, y, theta });
        assert_same(&whole.fraction(share).compose(&whole.fraction(1.0 - share)), &whole, 1e-10);
    }

    #[test]
    fn jacobians_of_composition_are_finite_differences(a in pose(), b in pose()) {
        let step = 1e-6;
        let plain = |pose: &Pose| [pose.x, pose.y, pose.theta];
        let first = a.compose_jacobian_first(&b);
        let second = a.compose_jacobian_second();
        for column in 0..3 {
            let moved = |pose: &Pose, by: f64| {
                let mut values = plain(pose);
                values[column] += by;
                Pose { x: values[0], y: values[1], theta: values[2] }
            };
            for (jacobian, above, below) in [
                (&first, moved(&a, step).compose(&b), moved(&a, -step).compose(&b)),
                (&second, a.compose(&moved(&b, step)), a.compose(&moved(&b, -step))),
            ] {
                let slope = [
                    (above.x - below.x) / (2.0 * step),
                    (above.y - below.y) / (2.0 * step),
                    difference(above.theta, below.theta) / (2.0 * step),
                ];
                for row in 0..3 {
                    prop_assert!((jacobian[(row, column)] - slope[row]).abs() < 1e-6 * (1.0 + slope[row].abs()));
                }
            }
        }
    }
}

#[test]
fn the_exponential_of_a_quarter_circle_is_its_end() {
    let radius = 2.0;
    let end = Pose::exp(&Twist { x: radius * PI / 2.0, y: 0.0, theta: PI / 2.0 });
    assert_same(&end, &Pose::new(radius, radius, PI / 2.0), 1e-14);
}

#[test]
fn the_exponential_is_continuous_through_straight_motion() {
    for theta in [1e-3, 1.001e-4, 0.999e-4, 1e-6, 1e-9, 0.0, -1e-9, -0.999e-4, -1.001e-4] {
        let end = Pose::exp(&Twist { x: 10.0, y: 0.0, theta });
        // Taylor series of an arc of 10 m, from its geometry.
        assert!((end.x - 10.0 * (1.0 - theta * theta / 6.0)).abs() < 1e-12);
        assert!((end.y - 10.0 * theta / 2.0 * (1.0 - theta * theta / 12.0)).abs() < 1e-12);
    }
}

#[test]
fn a_point_ahead_of_a_turned_pose_is_to_the_left() {
    let point = Pose::new(1.0, 2.0, PI / 2.0).transform(&Point::new(3.0, 0.0));
    assert!((point - Point::new(1.0, 5.0)).norm() < 1e-12);
}

#[test]
fn part_of_a_displacement_that_comes_back_to_its_heading_is_near() {
    for theta in [TAU, TAU - 1e-9, -2.0 * TAU, 1e6] {
        let part = Pose { x: 1.0, y: 0.0, theta }.fraction(0.5);
        assert!(part.position().norm() < 1.0, "{theta}: {part:?}");
    }
}

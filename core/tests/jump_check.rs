//! Whether the laser was knocked: from corrections worked out by hand.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use agv_core::filter::Ekf;
use agv_core::geometry::Pose;
use agv_core::integrity::{Estimate, JumpCheck, is_sure};
use nalgebra::Matrix3;

#[test]
fn a_pose_is_sure_while_three_of_its_deviations_are_less_than_a_slip() {
    // 5 cm and 26 mrad: a third is 16.7 mm of the position in all, so 11.8 mm along each axis, and 8.67 mrad.
    for (position, heading, expected) in [
        (0.001, 0.0001, true),
        (0.0117, 0.0086, true),
        (0.0119, 0.0086, false),
        (0.0117, 0.0088, false),
        (0.0119, 0.0001, false),
        (0.001, 0.0088, false),
        (0.5, 0.001, false),
        (0.001, 0.025, false),
    ] {
        let state = Ekf::new(Pose::new(3.0, -2.0, 1.0), position, heading);
        assert_eq!(is_sure(&state), expected, "{position} m, {heading} rad");
    }
}

/// An estimate that is exactly where the odometry alone leads.
fn estimate(pose: Pose, distance: f64) -> Estimate {
    Estimate { pose, odometry_pose: pose, covariance: Matrix3::zeros(), is_sure: true, distance }
}

#[test]
fn a_way_of_which_its_ends_are_less_than_four_fifths_apart_tells_no_motion() {
    for (distance, apart, leads_on) in [
        // Short ways do, wherever they end.
        (0.5, 0.1, true),
        (1.0, 0.0, true),
        (1.01, 0.0, false),
        (2.0, 1.61, true),
        (2.0, 1.59, false),
        (5.0, 4.01, true),
        (5.0, 3.99, false),
        (20.0, 16.1, true),
        (20.0, 15.9, false),
    ] {
        let mut check = JumpCheck::new();
        let start = estimate(Pose::new(1.0, 2.0, 0.5), 0.0);
        assert!(check.correct(&start, &start, true).is_none());
        let end = estimate(start.pose.compose(&Pose::new(0.6 * apart, 0.8 * apart, 0.3)), distance);
        let motion = check.correct(&end, &end, true).unwrap().motion;
        assert_eq!(motion.is_some(), leads_on, "{apart} m apart after {distance} m");
        if let Some(motion) = motion {
            let off = (motion.x - 0.6 * apart).hypot(motion.y - 0.8 * apart);
            assert!(off < 1e-12 && (motion.theta - 0.3).abs() < 1e-12, "{motion:?}");
        }
    }
}

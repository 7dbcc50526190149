//! What a controller reads off a pose: whether it is good, whether it has jumped, and how wrong it may be.

use agv_core::geometry::Pose;
use agv_core::integrity::ProtectionLevel;
use agv_core::state::{Mode, PoseOutput};

fn output(covariance: [f64; 6]) -> PoseOutput {
    let (pose, smooth) = (Pose::new(1.0, 2.0, 0.5), Pose::new(0.5, 2.5, 0.3));
    PoseOutput { pose, smooth, ..super::integrity::output(covariance, 2.0, [0.0; 2]) }
}

/// Deviations of the position along and across a direction, and of the heading.
fn turned(along: f64, across: f64, angle: f64, heading: f64) -> [f64; 6] {
    let (sine, cosine) = angle.sin_cos();
    let (long, short) = (along * along, across * across);
    [
        cosine * cosine * long + sine * sine * short,
        sine * cosine * (long - short),
        sine * sine * long + cosine * cosine * short,
        0.0,
        0.0,
        heading * heading,
    ]
}

const ANGLES: [f64; 5] = [0.0, 0.5, 1.2, 2.0, 2.9];

#[test]
fn a_good_pose_is_sure_in_every_direction() {
    for angle in ANGLES {
        let is_good = |along, heading| output(turned(along, 0.001, angle, heading)).is_good();
        assert!(is_good(0.00499, 0.0005239), "{angle}");
        assert!(!is_good(0.00501, 0.0005239), "{angle}");
        assert!(!is_good(0.00499, 0.0005241), "{angle}");
    }
}

#[test]
fn only_a_pose_that_nothing_speaks_against_is_good() {
    let modes = [
        (Mode::NotLocalised, false),
        (Mode::Reflectors, true),
        (Mode::Features, true),
        (Mode::Mixed, true),
        (Mode::DeadReckoning, true),
        (Mode::WithoutOdometry, false),
        (Mode::Lost, false),
        (Mode::Degraded, false),
    ];
    for (mode, is_good) in modes {
        let pose = PoseOutput { mode, ..output(turned(0.001, 0.001, 0.0, 0.0001)) };
        assert_eq!(pose.is_good(), is_good, "{mode:?}");
    }
}

#[test]
fn a_correction_by_more_than_a_centimetre_is_a_jump() {
    let has_jumped = |correction| PoseOutput { correction, ..output([0.0; 6]) }.has_jumped();
    assert_eq!([0.0, 0.0099, 0.01, 0.0101, 1.0].map(has_jumped), [false, false, false, true, true]);
}

#[test]
fn the_offset_leads_from_the_smooth_pose_to_the_pose() {
    let output = output([0.0; 6]);
    let offset = output.smooth_offset();
    let off = offset.compose(&output.smooth).between(&output.pose);
    assert!(off.x.hypot(off.y) < 1e-12 && off.theta.abs() < 1e-12, "{off:?}");
}

#[test]
fn bounds_grow_with_surprise_and_drift_as_stated() {
    // Deviations that a distance in the plane and a heading exceed with half of the risk.
    let position_factor = (-2.0 * (0.5 * ProtectionLevel::RISK).ln()).sqrt();
    let heading_factor = 5.4513; // 2 (1 - Phi(k)) = 5e-8, from tables.
    for angle in ANGLES {
        for (square, surprise) in [(0.5, 1.0), (2.0, 1.0), (8.0, 2.0)] {
            for (drift, heading_drift) in [(0.0, 0.0), (0.1, 0.0), (0.0, 0.05)] {
                let output = PoseOutput {
                    normalised_square: square,
                    drift: [drift, heading_drift],
                    ..output(turned(0.02, 0.01, angle, 0.003))
                };
                let level = ProtectionLevel::of(&output);
                let position = position_factor * surprise * 0.02 + 0.3 * drift + 0.060;
                let heading = heading_factor * surprise * 0.003 + 0.3 * heading_drift + 0.0175;
                assert!((level.position - position).abs() < 1e-3, "{} {position}", level.position);
                assert!((level.heading - heading).abs() < 2e-5, "{} {heading}", level.heading);
            }
        }
    }
}

//! What a controller reads off a pose: whether it is good, whether it has jumped, and how wrong it may be.

use agv_core::geometry::Pose;
use agv_core::integrity::ProtectionLevel;
use agv_core::measurement::Time;
use agv_core::state::{Mode, PoseOutput, Reason};

/// A pose by reflectors with that covariance.
pub fn sure_of(covariance: [f64; 6]) -> PoseOutput {
    PoseOutput {
        time: Time::default(),
        pose: Pose::default(),
        covariance,
        mode: Mode::Reflectors,
        reason: Reason::None,
        dead_reckoning_distance: 0.0,
        correction: 0.0,
        smooth: Pose::default(),
        level: ProtectionLevel { position: 0.04, heading: 0.007 },
        acceptance: 1.0,
        normalised_square: 2.0,
        resets: 0,
        last_reset: 0.0,
        overflows: 0,
    }
}

fn output(covariance: [f64; 6]) -> PoseOutput {
    let (pose, smooth) = (Pose::new(1.0, 2.0, 0.5), Pose::new(0.5, 2.5, 0.3));
    PoseOutput { pose, smooth, ..sure_of(covariance) }
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

//! Poses from outside, at the limits of what is taken.

use agv_core::localizer::{Event, Mode, PoseFix, Reason};

use super::support::stage::{Stage, parameters};

#[test]
fn a_pose_is_lost_above_the_largest_deviations_and_not_at_them() {
    let limits = parameters().limits;
    let (position, heading) = (limits.largest_position_deviation, limits.largest_heading_deviation);
    for (position, heading, is_lost) in [
        (position, 0.01, false),
        (position + 1e-6, 0.01, true),
        (0.01, heading, false),
        (0.01, heading + 1e-6, true),
        (position, heading, false),
    ] {
        let mut stage = Stage::new(parameters());
        let said = stage.tell(stage.truth, position, heading);
        let lost = (said.mode == Mode::Lost, said.reason == Reason::Uncertain);
        assert_eq!(lost, (is_lost, is_lost), "{position} m, {heading} rad: {said:?}");
    }
}

#[test]
fn a_pose_for_half_a_second_ahead_is_kept_and_one_for_longer_is_of_another_clock() {
    for (micros, is_kept) in [(100_000, true), (500_000, true), (500_001, false), (2_000_000, false)] {
        let mut stage = Stage::told(parameters());
        // The odometry speaks once more, 10 ms from now: until then nobody can tell.
        let time = stage.time().offset(0.01 + f64::from(micros) * 1e-6);
        let fix = PoseFix { time, pose: stage.truth, position_deviation: 0.01, heading_deviation: 0.003 };
        assert_ne!(stage.localizer.handle(&Event::SetPose(fix)).pose.mode, Mode::Lost);
        stage.sample += 1;
        stage.report(&agv_core::geometry::Pose::default());
        let said = stage.said();
        let expected = if is_kept { (Mode::DeadReckoning, Reason::NoLandmarks) } else { (Mode::Lost, Reason::NoPose) };
        assert_eq!((said.mode, said.reason), expected, "{micros} us ahead");
    }
}

/// A pose of a while ago: what was driven since is the distance without landmarks.
#[test]
fn the_distance_since_a_pose_in_the_past_is_what_was_driven_since() {
    let mut stage = Stage::told(parameters());
    let time = stage.time();
    for step in 1..=20 {
        stage.sample += 1;
        stage.report(&agv_core::geometry::Pose::new(0.001 * f64::from(step), 0.0, 0.0));
    }
    // The last twelve samples have gone 0.009 + ... + 0.020 m.
    let fix =
        PoseFix { time: time.offset(0.08), pose: stage.truth, position_deviation: 0.01, heading_deviation: 0.003 };
    let said = stage.localizer.handle(&Event::SetPose(fix)).pose;
    assert!((said.dead_reckoning_distance - 0.174).abs() < 1e-9, "{said:?}");
}

/// The distance without landmarks after which a pose is lost: at the limit itself it is not.
#[test]
fn a_pose_is_lost_beyond_the_longest_way_and_not_at_it() {
    let mut limited = parameters();
    limited.limits.lost_after = 0.25;
    let mut stage = Stage::told(limited);
    for step in 1..=20 {
        stage.sample += 1;
        // A sixty-fourth of a metre, so that sums are exact.
        stage.report(&agv_core::geometry::Pose::new(1.0 / 64.0, 0.0, 0.0));
        let lost = stage.said().mode == Mode::Lost;
        assert_eq!(lost, step > 16, "{step}: {:?}", stage.said());
    }
}

/// A level is kept only if it is asked for.
#[test]
fn without_protection_the_level_stays_as_it_was() {
    let mut parameters = parameters();
    parameters.protection = false;
    let mut stage = Stage::told(parameters);
    let before = stage.said().level;
    for _ in 0..5 {
        let revolution = stage.revolve(0.5, 0.1);
        stage.glimpse(&revolution);
        assert_eq!(stage.said().level, before);
    }
}

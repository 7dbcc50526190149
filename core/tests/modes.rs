//! What the localiser says of itself in each plight, and why.

use agv_core::geometry::{Point, Pose};
use agv_core::localizer::{Event, Mode, Outputs, PoseFix, PoseOutput, Reason};
use agv_core::measurement::{EncoderFault, EncoderFaults, ReflectorObservation};

use super::support::stage::{Stage, parameters};

fn said(output: &PoseOutput) -> (Mode, Reason) {
    (output.mode, output.reason)
}

/// Slowly on; after each revolution the vehicle looks as `look` says.
fn drive(stage: &mut Stage, revolutions: usize, mut look: impl FnMut(&mut Stage)) -> (Mode, Reason) {
    for _ in 0..revolutions {
        stage.drive(0.5, 0.02);
        look(stage);
    }
    said(&stage.said())
}

fn by_reflectors(stage: &mut Stage) {
    stage.look();
}

fn by_features(stage: &mut Stage) {
    stage.scan();
}

fn by_both(stage: &mut Stage) {
    stage.look();
    stage.scan();
}

fn blindly(_: &mut Stage) {}

fn fault(stage: &mut Stage, drive: Option<EncoderFault>, steering: Option<EncoderFault>) -> Outputs {
    stage.sample += 1;
    let faults = EncoderFaults { time: stage.time(), drive, steering };
    stage.localizer.handle(&Event::EncoderFaults(faults)).clone()
}

#[test]
fn the_mode_says_which_landmarks_the_pose_rests_on() {
    let mut stage = Stage::new(parameters());
    assert_eq!(drive(&mut stage, 2, by_both), (Mode::NotLocalised, Reason::NoPose));
    let mut stage = Stage::told(parameters());
    assert_eq!(drive(&mut stage, 6, by_reflectors), (Mode::Reflectors, Reason::None));
    assert_eq!(drive(&mut stage, 2, by_both), (Mode::Mixed, Reason::None));
    // Half a metre later the reflectors no longer count.
    assert_eq!(drive(&mut stage, 7, by_features), (Mode::Mixed, Reason::None));
    assert_eq!(drive(&mut stage, 3, by_features), (Mode::Features, Reason::None));
    assert_eq!(drive(&mut stage, 7, blindly), (Mode::Features, Reason::None));
    assert_eq!(drive(&mut stage, 3, blindly), (Mode::DeadReckoning, Reason::NoLandmarks));
    let (position, heading) = stage.error();
    assert!(position < 0.02 && heading < 0.005, "{position} {heading}");
    assert_eq!(drive(&mut stage, 1, by_reflectors), (Mode::Reflectors, Reason::None));
}

#[test]
fn the_way_since_a_landmark_is_said() {
    let mut stage = Stage::told(parameters());
    assert_eq!(stage.said().dead_reckoning_distance, 0.0);
    drive(&mut stage, 3, blindly);
    assert!((stage.said().dead_reckoning_distance - 0.18).abs() < 1e-6, "a given pose counts as landmarks do");
    drive(&mut stage, 1, by_reflectors);
    assert_eq!(stage.said().dead_reckoning_distance, 0.0);
    drive(&mut stage, 2, blindly);
    stage.scan();
    assert_eq!(stage.said().dead_reckoning_distance, 0.0);
    drive(&mut stage, 20, blindly);
    assert!((stage.said().dead_reckoning_distance - 1.2).abs() < 1e-6);
    let mut limited = parameters();
    limited.limits.lost_after = 1.0;
    let mut stage = Stage::told(limited);
    assert_eq!(drive(&mut stage, 16, blindly), (Mode::DeadReckoning, Reason::NoLandmarks));
    assert_eq!(drive(&mut stage, 1, blindly), (Mode::Lost, Reason::NoLandmarks));
    assert_eq!(drive(&mut stage, 4, by_both), (Mode::Lost, Reason::NoLandmarks), "until a pose is given");
    stage.tell(stage.truth, 0.005, 0.001);
    assert_eq!(drive(&mut stage, 1, by_both), (Mode::Mixed, Reason::None));
}

#[test]
fn a_pose_that_is_too_uncertain_is_lost() {
    for (position, heading, is_lost) in
        [(0.99, 0.01, false), (1.01, 0.01, true), (0.01, 0.199, false), (0.01, 0.201, true)]
    {
        let mut stage = Stage::new(parameters());
        let output = stage.tell(stage.truth, position, heading);
        let expected =
            if is_lost { (Mode::Lost, Reason::Uncertain) } else { (Mode::DeadReckoning, Reason::NoLandmarks) };
        assert_eq!(said(&output), expected, "{position} {heading}");
    }
}

#[test]
fn a_laser_that_looks_askew_degrades_the_pose() {
    // Its heading is taken for wrong by as much.
    let mut stage = Stage::new(parameters());
    stage.laser.theta += 0.03;
    stage.tell(stage.truth, 0.02, 0.05);
    assert_eq!(drive(&mut stage, 60, by_reflectors), (Mode::Degraded, Reason::LaserMoved));
    // Where no landmark is seen, that is the matter.
    assert_eq!(drive(&mut stage, 10, blindly), (Mode::DeadReckoning, Reason::NoLandmarks));
}

#[test]
fn an_odometry_that_landmarks_make_up_for_is_remarked() {
    let mut stage = Stage::told(parameters());
    stage.scale = 0.9;
    assert_eq!(drive(&mut stage, 40, by_reflectors), (Mode::Reflectors, Reason::OdometryDisagrees));
    assert_eq!(drive(&mut stage, 2, by_both), (Mode::Mixed, Reason::OdometryDisagrees));
    assert_eq!(drive(&mut stage, 10, by_features), (Mode::Features, Reason::OdometryDisagrees));
}

/// Of these of each twelve reflectors nothing is where it should be.
fn with_ghosts(count: usize) -> impl FnMut(&mut Stage) {
    move |stage| {
        let mut seen = stage.view();
        for one in seen.iter_mut().take(count) {
            let beyond = Point::new(30.0 + f64::from(one.range), f64::from(one.bearing));
            *one = stage.observe(&beyond);
        }
        stage.see(&seen);
    }
}

#[test]
fn landmarks_that_are_not_in_the_map_degrade_the_pose_and_then_lose_it() {
    let mut stage = Stage::told(parameters());
    assert_eq!(drive(&mut stage, 30, with_ghosts(2)), (Mode::Reflectors, Reason::None));
    let acceptance = stage.said().acceptance;
    assert!((acceptance - 10.0 / 12.0).abs() < 1e-6, "{acceptance}");
    assert_eq!(drive(&mut stage, 30, with_ghosts(5)), (Mode::Degraded, Reason::LandmarksRejected));
    assert!((stage.said().acceptance - 7.0 / 12.0).abs() < 1e-3);
    let (position, heading) = stage.error();
    assert!(position < 0.01 && heading < 0.002, "{position} {heading}");
    assert_eq!(drive(&mut stage, 30, with_ghosts(0)), (Mode::Reflectors, Reason::None));
    assert_eq!(drive(&mut stage, 30, with_ghosts(9)), (Mode::Lost, Reason::LandmarksRejected));
}

#[test]
fn innovations_larger_than_believed_lose_the_pose() {
    let noisy = |deviation: f32| {
        move |stage: &mut Stage| {
            let mut seen = stage.view();
            for (index, one) in seen.iter_mut().enumerate() {
                one.range += if index % 2 == 0 { deviation } else { -deviation };
            }
            stage.see(&seen);
        }
    };
    // 1 cm is believed of a distance.
    let mut stage = Stage::told(parameters());
    assert_eq!(drive(&mut stage, 20, noisy(0.012)), (Mode::Reflectors, Reason::None));
    let square = stage.said().normalised_square;
    assert!((0.5..2.0).contains(&square), "{square}");
    let mut stage = Stage::told(parameters());
    let mut last = stage.said();
    for _ in 0..20 {
        if last.mode == Mode::Lost {
            break;
        }
        drive(&mut stage, 1, noisy(0.038));
        last = stage.said();
    }
    assert_eq!(said(&last), (Mode::Lost, Reason::InnovationsTooLarge), "{last:?}");
    assert!(last.normalised_square > 5.0);
}

#[test]
fn an_encoder_fault_is_told_until_motions_come_again() {
    let late = Some(EncoderFault::Late);
    let cases =
        [(late, None, Reason::DriveEncoder), (None, late, Reason::SteeringEncoder), (late, late, Reason::DriveEncoder)];
    for (drive_fault, steering_fault, reason) in cases {
        let mut stage = Stage::told(parameters());
        drive(&mut stage, 4, by_reflectors);
        let before = stage.said();
        let output = fault(&mut stage, drive_fault, steering_fault).pose;
        assert_eq!(said(&output), (Mode::WithoutOdometry, reason));
        assert_eq!(output.time, stage.time());
        // As it went on, so it is assumed to.
        assert!((before.pose.between(&output.pose).x - 0.005).abs() < 1e-4, "{output:?}");
        // Landmarks alone say nothing of the odometry.
        assert_eq!(said(&stage.look()), (Mode::WithoutOdometry, reason));
        // The first sample behind it tells no motion yet, the time goes on.
        stage.sample += 1;
        stage.report(&Pose::new(0.2, 0.0, 0.0));
        assert_eq!((said(&stage.said()), stage.said().time), ((Mode::WithoutOdometry, reason), stage.time()));
        assert!((before.pose.between(&stage.said().pose).x - 0.01).abs() < 2e-3, "{:?}", stage.said());
        stage.sample += 1;
        stage.report(&Pose::new(0.005, 0.0, 0.0));
        assert_eq!(said(&stage.said()), (Mode::Reflectors, Reason::None));
    }
    // No fault is no doubt.
    let mut stage = Stage::told(parameters());
    drive(&mut stage, 4, by_reflectors);
    let before = stage.said();
    let after = fault(&mut stage, None, None).pose;
    assert_eq!(PoseOutput { correction: before.correction, ..after }, before);
}

#[test]
fn an_impossible_motion_is_a_doubt_until_a_possible_one() {
    let mut stage = Stage::told(parameters());
    drive(&mut stage, 4, by_reflectors);
    let before = stage.said();
    stage.sample += 1;
    stage.report(&Pose::new(0.2, 0.0, 0.0));
    let output = stage.said();
    assert_eq!(said(&output), (Mode::WithoutOdometry, Reason::OdometryImplausible));
    assert!((before.pose.between(&output.pose).x - 0.005).abs() < 1e-4);
    assert!(output.covariance[0] > before.covariance[0]);
    stage.sample += 1;
    stage.report(&Pose::new(0.005, 0.0, 0.0));
    assert_eq!(said(&stage.said()), (Mode::Reflectors, Reason::None));
}

#[test]
fn a_doubt_outlives_a_given_pose_and_the_vehicle_is_then_taken_to_stand() {
    let mut stage = Stage::told(parameters());
    drive(&mut stage, 4, by_reflectors);
    fault(&mut stage, Some(EncoderFault::Frozen), None);
    let told = Pose::new(1.0, 1.0, 0.5);
    assert_eq!(said(&stage.tell(told, 0.01, 0.01)), (Mode::WithoutOdometry, Reason::DriveEncoder));
    let output = fault(&mut stage, Some(EncoderFault::Frozen), None).pose;
    assert_eq!((output.pose, output.time), (told, stage.time()));
    // A vehicle that is lost says so first.
    assert_eq!(said(&stage.tell(told, 2.0, 0.01)), (Mode::Lost, Reason::Uncertain));
}

#[test]
fn a_given_pose_clears_what_was_held_against_the_last_one() {
    let mut stage = Stage::told(parameters());
    drive(&mut stage, 30, with_ghosts(9));
    assert_eq!(said(&stage.said()), (Mode::Lost, Reason::LandmarksRejected));
    let output = stage.tell(stage.truth, 0.005, 0.001);
    assert_eq!((output.acceptance, output.normalised_square), (1.0, 2.0));
    assert_eq!(drive(&mut stage, 2, by_reflectors), (Mode::Reflectors, Reason::None));
    // A pose that cannot be is left alone.
    let before = stage.said();
    for pose in [Pose { x: f64::NAN, ..before.pose }, Pose { y: 2e6, ..before.pose }] {
        assert_eq!(PoseOutput { correction: before.correction, ..stage.tell(pose, 0.01, 0.01) }, before);
    }
    assert_eq!(PoseOutput { correction: before.correction, ..stage.tell(before.pose, -0.01, 0.01) }, before);
}

#[test]
fn the_correction_is_what_landmarks_have_moved() {
    let mut stage = Stage::told(parameters());
    drive(&mut stage, 4, by_reflectors);
    stage.truth = stage.truth.compose(&Pose::new(0.0, 0.02, 0.0));
    stage.drive(0.5, 0.02);
    let before = stage.said();
    assert_eq!(before.correction, 0.0, "the odometry corrects nothing");
    let after = stage.look();
    let moved = (after.pose.x - before.pose.x).hypot(after.pose.y - before.pose.y);
    assert!((after.correction - moved).abs() < 1e-12 && moved > 1e-3, "{moved}");
    let nothing: [ReflectorObservation; 0] = [];
    assert_eq!(stage.see(&nothing).pose.correction, 0.0);
    assert_eq!(stage.said().smooth, before.smooth);
}

#[test]
fn a_pose_that_is_given_far_beside_the_one_that_was_contradicted_tells_of_a_knock() {
    let told = |beside: Pose| {
        let mut stage = Stage::told(parameters());
        drive(&mut stage, 10, by_reflectors);
        drive(&mut stage, 30, with_ghosts(9));
        assert_eq!(said(&stage.said()), (Mode::Lost, Reason::LandmarksRejected));
        stage.truth = stage.said().pose.compose(&beside);
        stage.tell(stage.truth, 0.001, 0.0005);
        said(&stage.look())
    };
    let (fine, knocked) = ((Mode::Reflectors, Reason::None), (Mode::Degraded, Reason::LaserMoved));
    // A wheel that has spun, or slid a little, is none, nor is what the odometry drifts by on the way without landmarks.
    assert_eq!(told(Pose::new(0.5, 0.03, 0.015)), fine);
    assert_eq!([0.3, -0.3].map(|side| told(Pose::new(0.0, side, 0.0))), [knocked; 2]);
    assert_eq!([0.25, -0.25].map(|turn| told(Pose::new(0.0, 0.0, turn))), [knocked; 2]);
    // Who was never right after the last pose was told it wrongly.
    let mut stage = Stage::told(parameters());
    drive(&mut stage, 30, with_ghosts(12));
    assert_eq!(stage.said().mode, Mode::Lost);
    stage.truth = stage.said().pose.compose(&Pose::new(0.0, 0.4, 0.3));
    stage.tell(stage.truth, 0.001, 0.0005);
    assert_eq!(said(&stage.look()), fine);
}

fn fail_encoders(stage: &mut Stage) {
    let faults = EncoderFaults { time: stage.time(), drive: Some(EncoderFault::Missing), ..EncoderFaults::default() };
    stage.localizer.handle(&Event::EncoderFaults(faults));
}

#[test]
fn an_odometry_that_failed_is_no_reason_to_doubt_the_laser() {
    let fine = (Mode::Reflectors, Reason::None);
    // It was somewhere else when it could tell again, and was put right by a pose that is given.
    let mut stage = Stage::told(parameters());
    drive(&mut stage, 10, by_reflectors);
    fail_encoders(&mut stage);
    drive(&mut stage, 30, with_ghosts(12));
    assert_eq!(said(&stage.said()).0, Mode::Lost);
    stage.truth = stage.said().pose.compose(&Pose::new(0.4, 0.3, 0.1));
    stage.tell(stage.truth, 0.02, 0.003);
    assert_eq!(drive(&mut stage, 3, by_reflectors), fine);
    // And so if the first pose that was given was wrong, and the reflectors pulled it away before they were rejected.
    let mut stage = Stage::told(parameters());
    drive(&mut stage, 10, by_reflectors);
    fail_encoders(&mut stage);
    stage.truth = stage.truth.compose(&Pose::new(0.4, 0.3, 0.1));
    stage.tell(stage.truth.compose(&Pose::new(-0.13, 0.0, 0.0)), 0.02, 0.003);
    drive(&mut stage, 1, by_reflectors);
    drive(&mut stage, 30, with_ghosts(12));
    assert_eq!(said(&stage.said()).0, Mode::Lost);
    stage.tell(stage.truth, 0.02, 0.003);
    assert_eq!(drive(&mut stage, 3, by_reflectors), fine);
}

#[test]
fn who_coasts_goes_on_as_of_late_and_not_as_in_one_interval() {
    let mut stage = Stage::told(parameters());
    // Of two samples the first has all the way, and the second has none.
    for number in 0..30_u8 {
        stage.sample += 1;
        let step = Pose::new(if number % 2 == 0 { 0.02 } else { 0.0 }, 0.0, 0.0);
        stage.truth = stage.truth.compose(&step);
        stage.report(&step);
    }
    stage.sample += 30;
    fail_encoders(&mut stage);
    let way = stage.said().pose;
    let off = stage.truth.between(&way);
    assert!((off.x - 0.3).abs() < 0.02 && off.y.abs() < 1e-9, "{off:?}");
}

#[test]
fn of_a_motion_during_which_a_pose_is_given_the_rest_counts() {
    for late in [0.0, 0.004, 0.01] {
        let mut stage = Stage::told(parameters());
        drive(&mut stage, 2, by_reflectors);
        let pose = Pose::new(1.0, 1.0, 0.0);
        let time = stage.time().offset(late);
        let fix = PoseFix { time, pose, position_deviation: 0.01, heading_deviation: 0.01 };
        stage.localizer.handle(&Event::SetPose(fix));
        stage.sample += 1;
        stage.report(&Pose::new(0.02, 0.0, 0.0));
        let rest = 0.02 * (1.0 - late / 0.01);
        assert!((stage.said().pose.x - 1.0 - rest).abs() < 1e-9, "{late} {:?}", stage.said());
        assert!((stage.said().dead_reckoning_distance - rest).abs() < 1e-9);
        assert_eq!(stage.said().time, stage.time());
    }
}

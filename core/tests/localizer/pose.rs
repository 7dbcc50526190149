//! What the localiser says of its pose.

use agv_core::geometry::Pose;
use agv_core::localizer::{Event, Mode, OutputPredictor, PoseFix, PoseOutput, Reason};
use agv_core::maps::Verdict;
use agv_core::measurement::{ReflectorObservation, Reflectors};
use agv_core::sensing::falko;

use super::drive::{Drive, Small, TICK, parameters, scan};

#[test]
fn nothing_is_said_of_the_pose_before_one_is_given() {
    let mut drive = Drive::start();
    let output = drive.revolutions(3, |_| true);
    assert_eq!((output.mode, output.reason), (Mode::NotLocalised, Reason::NoPose));
    assert!(drive.localizer.outputs().uses.is_empty());
}

#[test]
fn reflectors_correct_a_start_beside_the_truth() {
    let mut drive = Drive::start();
    drive.set_pose(Pose::new(0.04, -0.03, 0.008));
    let output = drive.revolutions(8, |_| true);
    assert_eq!((output.mode, output.reason), (Mode::Reflectors, Reason::None));
    let truth = drive.truth(output.time);
    let error = (output.pose.x - truth.x).hypot(output.pose.y - truth.y);
    assert!(error < 0.004 && output.pose.theta.abs() < 1e-3, "{error} m, {} rad", output.pose.theta);
    assert!(output.acceptance > 0.99 && output.dead_reckoning_distance < 0.2);
}

#[test]
fn a_vehicle_that_stands_among_reflectors_says_when_its_pose_is_good() {
    let mut drive = Drive::start();
    let told = drive.set_pose(Pose::new(0.04, -0.03, 0.008));
    assert!(!told.is_good());
    let mut revolutions = 0;
    while !drive.localizer.outputs().pose.is_good() {
        drive.stand(|id| id < 8);
        revolutions += 1;
        assert!(revolutions < 40, "{:?}", drive.localizer.outputs().pose);
    }
    assert!(revolutions > 1, "one revolution is not enough");
    let pose = drive.localizer.outputs().pose.pose;
    assert!(pose.x.hypot(pose.y) < 0.005 && pose.theta.abs() < 0.524e-3, "{pose:?}");
    // Without reflectors it stays so only for a while.
    assert!(!drive.revolutions(40, |_| false).is_good());
}

#[test]
fn corrections_are_said_and_leave_no_step_in_the_smooth_pose() {
    let mut drive = Drive::start();
    let start = Pose::new(0.04, -0.03, 0.008);
    assert_eq!(drive.set_pose(start).correction, 0.0);
    // Straight on by what the encoders say since their first sample, whatever the reflectors do.
    let smooth = |drive: &Drive| start.compose(&Pose::new((drive.step - 1) as f64 * 0.01, 0.0, 0.0));
    let is_smooth = |drive: &Drive, output: &PoseOutput| {
        let off = smooth(drive).between(&output.smooth);
        off.x.hypot(off.y) < 2.0 * TICK && off.theta.abs() < 1e-9
    };
    drive.revolutions(1, |_| false);
    let before = drive.localizer.outputs().pose;
    assert!(is_smooth(&drive, &before) && before.correction == 0.0 && !before.has_jumped());
    let after = drive.look(|_| true);
    let moved = (after.pose.x - before.pose.x).hypot(after.pose.y - before.pose.y);
    assert!(is_smooth(&drive, &after) && after.has_jumped() && (after.correction - moved).abs() < 1e-9, "{after:?}");
    for _ in 0..20 {
        let output = drive.revolutions(1, |_| true);
        assert!(is_smooth(&drive, &output), "{output:?}");
    }
    assert!(!drive.localizer.outputs().pose.has_jumped());
    // Both together are the pose.
    let output = drive.localizer.outputs().pose;
    let together = output.smooth_offset().compose(&output.smooth);
    assert!((together.x - output.pose.x).hypot(together.y - output.pose.y) < 1e-9);
}

#[test]
fn a_pose_of_a_clock_that_is_ahead_is_given_up_when_the_odometry_speaks() {
    let mut drive = Drive::start();
    drive.revolutions(4, |_| true);
    let last = drive.localizer.outputs().pose;
    let fix =
        PoseFix { time: last.time.offset(5.0), pose: last.pose, position_deviation: 0.01, heading_deviation: 0.003 };
    drive.localizer.handle(&Event::SetPose(fix));
    let said = drive.revolutions(1, |_| false);
    assert_eq!((said.mode, said.reason), (Mode::Lost, Reason::NoPose));
    // One of now is taken.
    let said = drive.set_pose(last.pose);
    assert!(said.time < fix.time && said.mode != Mode::Lost, "{said:?}");
}

#[test]
fn a_jump_is_told_to_who_asks_later() {
    let mut drive = Drive::start();
    let mut predictor: OutputPredictor = OutputPredictor::new(&parameters());
    assert_eq!((drive.localizer.outputs().pose.resets, drive.localizer.outputs().pose.last_reset), (0, 0.0));
    let given = drive.set_pose(Pose::new(0.04, -0.03, 0.008));
    assert_eq!((given.resets, given.last_reset), (1, 0.0));
    let before = drive.revolutions(1, |_| false);
    assert_eq!(before.resets, 1);
    let after = drive.look(|_| true);
    let moved = (after.pose.x - before.pose.x).hypot(after.pose.y - before.pose.y);
    // The encoders say something before anybody asks.
    drive.revolutions(1, |_| false);
    predictor.update(&drive.localizer.outputs().pose, &drive.localizer.prediction_state());
    for told in [drive.localizer.outputs().pose, predictor.output().unwrap()] {
        assert!(!told.has_jumped() && moved > PoseOutput::NOTABLE_CORRECTION);
        assert_eq!((told.resets, told.last_reset), (2, moved as f32));
    }
    // Small corrections are none.
    assert_eq!(drive.revolutions(20, |_| true).resets, 2);
    let last = drive.localizer.outputs().pose;
    let put = drive.set_pose(Pose { x: last.pose.x + 3.0, y: last.pose.y - 4.0, theta: 0.0 });
    assert!(put.resets == 3 && (put.last_reset - 5.0).abs() < 1e-5, "{put:?}");
    for _ in 0..256 {
        drive.set_pose(Pose::default());
    }
    assert_eq!(drive.localizer.outputs().pose.resets, 3);
}

#[test]
fn every_reflector_is_used_at_its_own_time() {
    // At 1 m/s the vehicle moves 12 cm within a revolution; noise-free observations leave millimetres only if each is
    // taken from where the vehicle was.
    let mut drive = Drive::start();
    drive.set_pose(Pose::default());
    drive.revolutions(40, |_| true);
    let worst = drive.localizer.outputs().uses.iter().map(|used| used.residual[0].abs()).fold(0.0, f64::max);
    assert!(worst < 0.003, "{worst} m");
}

#[test]
fn without_landmarks_it_reckons_and_says_how_far() {
    let mut drive = Drive::start();
    drive.set_pose(Pose::default());
    drive.revolutions(8, |_| true);
    let before = drive.localizer.outputs().pose;
    let output = drive.revolutions(40, |_| false);
    assert_eq!((output.mode, output.reason), (Mode::DeadReckoning, Reason::NoLandmarks));
    assert!((output.dead_reckoning_distance - 4.8).abs() < 0.15, "{}", output.dead_reckoning_distance);
    assert!(output.covariance[2] > 4.0 * before.covariance[2]);
    // Landmarks come back: so does the mode.
    assert_eq!(drive.revolutions(4, |_| true).mode, Mode::Reflectors);
    let mut reckoned = Drive::start();
    let mut strict = parameters();
    strict.limits.lost_after = 3.0;
    *reckoned.localizer = Small::new(strict);
    reckoned.set_pose(Pose::default());
    let output = reckoned.revolutions(30, |_| false);
    assert_eq!((output.mode, output.reason), (Mode::Lost, Reason::NoLandmarks));
}

#[test]
fn a_given_heading_of_many_turns_is_said_as_one_of_none() {
    let mut drive = Drive::start();
    let output = drive.set_pose(Pose { x: 1.0, y: 2.0, theta: 1000.0 });
    assert_eq!(output.pose, Pose::new(1.0, 2.0, 1000.0));
    assert!(output.pose.theta.abs() < 3.2);
}

#[test]
fn some_false_reflectors_change_nothing() {
    let mut drive = Drive::start();
    drive.set_pose(Pose::default());
    drive.revolutions(4, |_| true);
    for index in 0..20 {
        let ghost = ReflectorObservation {
            time: drive.time(),
            range: 2.0 + 0.3 * (index % 7) as f32,
            bearing: 0.9 * (index % 5) as f32 - 1.3,
        };
        let outputs = drive.localizer.handle(&Event::Reflectors(Reflectors::of_first(&[ghost])));
        assert_ne!(outputs.uses[0].verdict, Verdict::Accepted);
        assert_eq!(drive.revolutions(1, |_| true).mode, Mode::Reflectors);
    }
    let output = drive.localizer.outputs().pose;
    assert!((output.pose.x - drive.truth(output.time).x).abs() < 0.003);
}

#[test]
fn a_vehicle_that_is_lost_learns_no_landmarks() {
    let mut drive = Drive::start();
    let mut parameters = parameters();
    parameters.maps.dynamic = true;
    parameters.features.detector = falko::Parameters::thesis();
    parameters.limits.lost_after = 2.0;
    *drive.localizer = Small::new(parameters);
    drive.set_pose(Pose::default());
    // A square room of 5 m whose corners are seen.
    let ranges: Vec<f32> = (0..360)
        .map(|degree| f64::from(degree).to_radians())
        .map(|angle| (2.5 / angle.cos().abs().max(angle.sin().abs())) as f32)
        .collect();
    let look = |drive: &mut Drive| {
        let start = drive.travel();
        drive.localizer.handle(&scan(start, &ranges, &[]));
    };
    look(&mut drive);
    let learnt = drive.localizer.dynamic_landmarks().to_vec();
    assert!(!learnt.is_empty());
    drive.revolutions(30, |_| false);
    assert_eq!(drive.localizer.outputs().pose.mode, Mode::Lost);
    look(&mut drive);
    assert_eq!(drive.localizer.dynamic_landmarks(), learnt);
}

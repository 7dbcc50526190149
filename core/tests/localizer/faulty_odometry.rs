//! An odometry that says what cannot be, or nothing.

use agv_core::geometry::Pose;
use agv_core::localizer::{Event, Mode, PoseFix, Reason};
use agv_core::measurement::{EncoderFault, EncoderFaults, EncoderSample, PoseIncrement, Time};
use agv_core::odometry::Vehicle;

use super::drive::{Drive, Small, TICK, parameters};

#[test]
fn an_impossible_motion_is_said_and_not_believed() {
    let mut drive = Drive::start();
    drive.set_pose(Pose::default());
    drive.revolutions(4, |_| true);
    let before = drive.localizer.outputs().pose;
    drive.step += 1;
    let jump = EncoderSample { time: drive.time(), drive: 90_000, steering: 0 };
    let output = drive.localizer.handle(&Event::Encoders(jump)).pose;
    assert_eq!(output.reason, Reason::OdometryImplausible);
    assert!((output.pose.x - before.pose.x - 0.01).abs() < 0.002);
}

#[test]
fn an_encoder_fault_is_a_mode_whose_uncertainty_covers_what_the_vehicle_does() {
    let mut drive = Drive::start();
    drive.set_pose(Pose::default());
    let before = drive.revolutions(4, |_| true);
    let last_step = drive.step;
    let mut output = before;
    // The true vehicle brakes to a standstill with 2 m/s^2 when its encoder fails.
    let mut way = 0.0;
    for step in 1..=40 {
        drive.step += 1;
        let elapsed = f64::from(step) * 0.01;
        way = elapsed - elapsed * elapsed;
        let faults = EncoderFaults { time: drive.time(), drive: Some(EncoderFault::Missing), steering: None };
        output = drive.localizer.handle(&Event::EncoderFaults(faults)).pose;
        assert_eq!((output.mode, output.reason), (Mode::WithoutOdometry, Reason::DriveEncoder));
        assert_eq!(output.time, drive.time());
        let error = (output.pose.x - before.pose.x - way).abs();
        assert!(error <= 3.0 * output.covariance[0].sqrt(), "{step}: {error}");
    }
    assert!(output.covariance[0].sqrt() < 0.2);
    // Sound samples again, the counter having stood still or not: no way is invented.
    let base = (last_step as f64 * 0.01 / TICK).round() as u32 + 77_777;
    for _ in 0..2 {
        drive.step += 1;
        let sample = EncoderSample { time: drive.time(), drive: base, steering: 0 };
        output = drive.localizer.handle(&Event::Encoders(sample)).pose;
    }
    assert_eq!((output.mode, output.reason), (Mode::Reflectors, Reason::None));
    assert!((output.pose.x - before.pose.x - way).abs() <= 3.0 * output.covariance[0].sqrt());
    assert!(output.pose.x - before.pose.x < 0.42);
}

#[test]
fn an_increment_of_more_than_half_a_turn_is_no_motion() {
    let mut parameters = parameters();
    parameters.vehicle = Vehicle::Increments;
    for theta in [f64::MAX, -1e3, 3.15] {
        let mut localizer = Box::new(Small::new(parameters));
        let time = |step: u64| Time::from_micros(1_000_000 + step * 10_000);
        let pose = Pose::new(1.0, 2.0, 0.5);
        let fix = PoseFix { time: time(0), pose, position_deviation: 0.02, heading_deviation: 0.005 };
        localizer.handle(&Event::SetPose(fix));
        for (step, theta) in [(0, 0.0), (1, theta)] {
            let displacement = Pose { x: 0.001, y: 0.0, theta };
            localizer.handle(&Event::Increment(PoseIncrement { time: time(step), displacement }));
        }
        let output = localizer.outputs().pose;
        assert_eq!((output.mode, output.reason), (Mode::WithoutOdometry, Reason::OdometryImplausible));
        assert_eq!(output.pose, pose);
    }
}

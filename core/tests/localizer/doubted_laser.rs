//! When the laser is doubted, and when not.

use agv_core::geometry::Pose;
use agv_core::localizer::{Event, Mode, PoseFix, Reason};
use agv_core::measurement::EncoderSample;

use super::drive::{Drive, TICK};

#[test]
fn a_start_that_is_unsure_is_no_reason_to_doubt_the_laser() {
    // One reflector in sight, so that the way has to show where the vehicle is; beside a well of offsets that the
    // stated deviations allow.
    for step in 0..24_u32 {
        let angle = f64::from(step) * 0.9;
        let (deviation, heading_deviation) = (0.3, 0.05);
        let mut drive = Drive::start();
        let pose =
            Pose::new(1.2 * deviation * angle.cos(), deviation * angle.sin(), heading_deviation * (3.0 * angle).cos());
        let fix = PoseFix { time: drive.time(), pose, position_deviation: deviation, heading_deviation };
        drive.localizer.handle(&Event::SetPose(fix));
        for revolution in 0..80_u16 {
            let seen = 2 + revolution / 20;
            let output = drive.revolutions(1, |id| id == seen);
            assert_ne!(output.reason, Reason::LaserMoved, "{step}, {revolution}");
        }
        let output = drive.localizer.outputs().pose;
        let truth = drive.truth(output.time);
        let error = (output.pose.x - truth.x).hypot(output.pose.y - truth.y);
        assert!(
            output.mode == Mode::Reflectors && error < 0.1,
            "{step}: {error} m, {:?} {:?}",
            output.mode,
            output.reason
        );
    }
}

#[test]
fn after_a_jump_to_the_side_the_laser_is_doubted_if_the_jump_is_sure() {
    for (position_deviation, reason) in [(0.02, Reason::LaserMoved), (0.3, Reason::None)] {
        let mut drive = Drive::start();
        drive.set_pose(Pose::default());
        drive.revolutions(8, |_| true);
        drive.offset = 0.6;
        drive.revolutions(6, |_| true);
        assert_eq!(drive.localizer.outputs().pose.reason, Reason::MotionDisagrees);
        let pose = drive.truth(drive.time());
        let fix = PoseFix { time: drive.time(), pose, position_deviation, heading_deviation: 0.005 };
        drive.localizer.handle(&Event::SetPose(fix));
        assert_eq!(drive.revolutions(4, |_| true).reason, reason);
    }
}

#[test]
fn a_laser_that_looks_askew_is_doubted() {
    for degrees in [-1.0_f64, 1.0] {
        let mut drive = Drive::start();
        drive.laser.theta = degrees.to_radians();
        // By what it sees, the vehicle stands askew.
        drive.set_pose(Pose::new(0.0, 0.0, degrees.to_radians()));
        let is_doubted = (0..40).any(|_| drive.revolutions(1, |_| true).reason == Reason::LaserMoved);
        assert!(is_doubted, "{degrees}: {:?}", drive.localizer.outputs().pose);
    }
}

#[test]
fn what_a_long_way_out_and_back_adds_up_to_is_no_knock() {
    let mut drive = Drive::start();
    drive.set_pose(Pose::default());
    drive.revolutions(8, |_| true);
    // Twelve metres on and twelve back, with nothing to see: it ends where it began, but for what the wheels slid.
    for step in 0..2400 {
        drive.step += 1;
        if step >= 1200 {
            drive.stood += 2;
        }
        let ticks = ((drive.step as f64 - drive.stood as f64) * 0.01 / TICK).round() as u32;
        let sample = EncoderSample { time: drive.time(), drive: ticks, steering: 0 };
        drive.localizer.handle(&Event::Encoders(sample));
    }
    drive.offset = 0.1;
    for _ in 0..10 {
        let output = drive.revolutions(1, |_| true);
        assert_eq!((output.mode, output.reason), (Mode::Reflectors, Reason::None));
    }
}

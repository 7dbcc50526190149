//! A laser that moves on its mounting while the vehicle drives.

use agv_core::geometry::Pose;

use super::drive::Drive;

const STRAIGHT: Pose = Pose { x: 0.125, y: 0.0, theta: 0.0 };
const BEND: Pose = Pose { x: 0.1, y: 0.002, theta: 0.04 };

/// Drives on while the laser moves by that in each revolution.
fn drive_on(drive: &mut Drive, revolutions: usize, step: &Pose, creep: &Pose, case: &str) {
    for _ in 0..revolutions {
        drive.true_mount = drive.true_mount.compose(creep);
        drive.revolve(step);
        drive.assert_held(format_args!("{case}"));
    }
}

/// The published pose turns with the laser; the way driven tells the heading, so that the level holds it.
#[test]
fn a_laser_that_turns_by_itself_is_held_at_any_rate() {
    for (seed, degrees_a_second) in [(1, 0.05), (2, 0.2), (3, 0.5), (4, 1.0), (5, -0.3)] {
        let creep = Pose::new(0.0, 0.0, (0.125_f64 * degrees_a_second).to_radians());
        let mut drive = Drive::new(seed);
        drive_on(&mut drive, 40, &STRAIGHT, &Pose::default(), "before");
        assert!(drive.monitor.level().heading < 0.015, "{:?}", drive.monitor.level());
        drive_on(&mut drive, 40, &STRAIGHT, &creep, "on a straight");
        drive_on(&mut drive, 40, &BEND, &creep, "in a bend");
        drive_on(&mut drive, 40, &STRAIGHT, &creep, "after it");
    }
}

/// A laser that stays where it is costs little: neither is a creep found, nor is the level wide.
#[test]
fn a_laser_that_stays_is_not_found_to_creep() {
    for seed in 1..40 {
        let mut drive = Drive::new(seed);
        for (revolutions, step) in [(60, STRAIGHT), (40, BEND), (200, STRAIGHT)] {
            drive_on(&mut drive, revolutions, &step, &Pose::default(), "at rest");
            let level = drive.monitor.level();
            assert!(level.position < 0.08 && level.heading < 0.0075, "seed {seed}: {level:?}");
        }
    }
}

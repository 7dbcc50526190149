use agv_core::geometry::Pose;

use super::drive::Drive;

/// Drives so many revolutions, 0.125 m each, on which so many landmarks are elsewhere.
fn go(drive: &mut Drive, revolutions: usize, elsewhere: usize) {
    drive.elsewhere = elsewhere;
    for _ in 0..revolutions {
        drive.revolve(&Pose::new(0.125, 0.0, 0.0));
    }
}

/// Finds itself anew where it is, and drives 30 m on among landmarks that all fit.
fn go_on_anew(drive: &mut Drive) {
    drive.monitor.begin(drive.time, &drive.published, &[1e-4, 0.0, 1e-4, 0.0, 0.0, 1e-5], &drive.odometry);
    go(drive, 240, 0);
}

#[test]
fn a_map_of_two_surveys_is_remembered_by_who_finds_itself_anew() {
    let mut drive = Drive::new(1);
    go(&mut drive, 40, 2);
    go_on_anew(&mut drive);
    let level = drive.monitor.level();
    // They are 0.3 m apart at 8 m: turned against each other by as much they part with the way behind the seam.
    let turned = 0.3 / 8.0;
    assert!(level.position >= 0.3 + 29.0 * turned && level.heading >= turned, "{level:?}");
    drive.monitor.trust_map();
    go(&mut drive, 1, 0);
    assert!(drive.monitor.level().position < 0.3, "{:?}", drive.monitor.level());
}

#[test]
fn a_landmark_that_was_moved_or_two_false_ones_condemn_no_map() {
    for looks in [&[(400, 1)][..], &[(4, 2), (120, 0), (4, 2), (120, 0)], &[(20, 0), (1, 3), (3, 0), (1, 3), (20, 0)]] {
        let mut drive = Drive::new(1);
        for (revolutions, elsewhere) in looks {
            go(&mut drive, *revolutions, *elsewhere);
        }
        go_on_anew(&mut drive);
        assert!(drive.monitor.level().position < 0.3, "{looks:?}: {:?}", drive.monitor.level());
    }
}

#[test]
fn a_vehicle_that_stands_sees_the_same_again_and_again() {
    let mut drive = Drive::new(1);
    drive.elsewhere = 3;
    for _ in 0..400 {
        drive.revolve(&Pose::default());
    }
    go_on_anew(&mut drive);
    assert!(drive.monitor.level().position < 0.3, "{:?}", drive.monitor.level());
}

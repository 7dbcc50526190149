//! A vehicle that was carried away.

use agv_core::geometry::Pose;
use agv_core::localizer::{Mode, Reason};
use agv_core::sensing::ReflectorDetection;

use super::drive::{Drive, Small, parameters, reflectors, scan, scan_of};

#[test]
fn a_vehicle_that_was_carried_away_is_lost_and_can_be_put_back() {
    let mut drive = Drive::start();
    drive.set_pose(Pose::default());
    drive.revolutions(8, |_| true);
    drive.offset = 0.6;
    let mut revolutions = 0;
    while drive.localizer.outputs().pose.mode != Mode::Lost {
        revolutions += 1;
        assert!(revolutions < 6, "it still believes its pose");
        drive.revolutions(1, |_| true);
    }
    assert_eq!(drive.localizer.outputs().pose.reason, Reason::MotionDisagrees);
    // It stays lost, however well a later scan may fit.
    drive.offset = 0.0;
    assert_eq!(drive.revolutions(4, |_| true).mode, Mode::Lost);
    let here = drive.truth(drive.time());
    drive.set_pose(here);
    assert_eq!(drive.revolutions(4, |_| true).mode, Mode::Reflectors);
}

#[test]
fn a_vehicle_that_was_carried_away_is_lost_though_each_revolution_has_a_scan_too() {
    let mut drive = Drive::start();
    drive.set_pose(Pose::default());
    let revolution = |drive: &mut Drive| {
        let start = drive.time();
        drive.revolutions(1, |_| true);
        let (ranges, _) = scan_of(start, &[]);
        drive.localizer.handle(&scan(start, &ranges, &[])).pose
    };
    for _ in 0..8 {
        assert_eq!(revolution(&mut drive).mode, Mode::Reflectors);
    }
    drive.offset = 0.6;
    let told = (0..6).map(|_| revolution(&mut drive)).find(|output| output.mode == Mode::Lost);
    assert_eq!(told.map(|output| output.reason), Some(Reason::MotionDisagrees));
}

#[test]
fn a_vehicle_that_was_carried_away_is_lost_where_its_reflectors_are_found_in_scans() {
    let mut drive = Drive::start();
    let mut parameters = parameters();
    parameters.reflectors.detection = Some(ReflectorDetection::default());
    // A beam a degree.
    parameters.reflectors.bearing_deviation = 0.01;
    *drive.localizer = Small::new(parameters);
    drive.localizer.add_landmarks(&reflectors()).unwrap();
    drive.set_pose(Pose::default());
    let revolution = |drive: &mut Drive| {
        let start = drive.travel();
        let seen: Vec<_> = reflectors().iter().filter_map(|reflector| drive.observe(start, reflector)).collect();
        let (ranges, intensities) = scan_of(start, &seen);
        drive.localizer.handle(&scan(start, &ranges, &intensities)).pose
    };
    for _ in 0..8 {
        assert_eq!(revolution(&mut drive).mode, Mode::Reflectors);
    }
    drive.offset = 0.6;
    let told = (0..6).map(|_| revolution(&mut drive)).find(|output| output.mode == Mode::Lost);
    assert_eq!(told.map(|output| output.reason), Some(Reason::MotionDisagrees));
}

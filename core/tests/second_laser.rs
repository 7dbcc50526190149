//! Two lasers on one vehicle: each observation is used from where its own laser is mounted.

use agv_core::geometry::{Pose, difference};
use agv_core::localizer::{Event, MapUse, Misuse, Mode, Parameters};
use agv_core::maps::Verdict;
use agv_core::measurement::{LaserId, ReflectorObservation, Reflectors};

use super::support::stage::{LASER, Stage, parameters};

/// At the rear, and looking back.
const REAR: Pose = Pose { x: -0.4, y: -0.3, theta: 3.0 };

fn second() -> LaserId {
    LaserId::new(1).unwrap_or_default()
}

fn with_two() -> Parameters {
    let mut two = parameters();
    two.lasers = two.lasers.with(second(), REAR);
    two
}

fn see(stage: &mut Stage, laser: LaserId, observations: &[ReflectorObservation]) {
    stage.localizer.handle(&Event::Reflectors(Reflectors { laser, observations }));
}

/// Revolutions by both lasers in turn; the largest error of position, m, and heading, rad, behind the first ones.
fn drive(stage: &mut Stage, revolutions: usize) -> (f64, f64) {
    stage.tell(stage.truth, 0.02, 0.01);
    let mut worst = (0.0_f64, 0.0_f64);
    for number in 0..revolutions {
        let (laser, mount) = if number % 2 == 0 { (LaserId::FIRST, LASER) } else { (second(), REAR) };
        stage.laser = mount;
        let seen = stage.revolve(0.8, 0.1).reflectors();
        see(stage, laser, &seen);
        assert!(stage.localizer.outputs().uses.iter().all(|seen| seen.laser == laser));
        let said = stage.said();
        if number > 4 {
            let off = said.pose.between(&stage.truth);
            worst =
                (worst.0.max(off.x.hypot(off.y)), worst.1.max(difference(said.pose.theta, stage.truth.theta).abs()));
        }
    }
    worst
}

#[test]
fn both_lasers_keep_the_vehicle_where_it_is() {
    for slam in [false, true] {
        let mut two = with_two();
        two.maps = MapUse { slam, ..two.maps };
        let mut stage = Stage::new(two);
        let (position, heading) = drive(&mut stage, 24);
        assert!(position < 2e-3 && heading < 5e-4, "slam {slam}: {position} m, {heading} rad");
        assert!(matches!(stage.said().mode, Mode::Reflectors | Mode::Mixed), "{:?}", stage.said());
    }
}

#[test]
fn what_the_second_laser_sees_fits_nothing_from_where_the_first_one_is() {
    let mut two = with_two();
    two.lasers = two.lasers.with(second(), LASER);
    let mut stage = Stage::new(two);
    stage.tell(stage.truth, 0.02, 0.01);
    stage.laser = REAR;
    let seen = stage.revolve(0.8, 0.1).reflectors();
    see(&mut stage, second(), &seen);
    let uses = &stage.localizer.outputs().uses;
    assert!(!uses.is_empty() && uses.iter().filter(|seen| seen.verdict == Verdict::Accepted).count() <= 1, "{uses:?}");
}

#[test]
fn a_laser_that_is_mounted_nowhere_is_told_and_not_used() {
    let mut stage = Stage::new(parameters());
    stage.tell(stage.truth, 0.02, 0.01);
    let before = stage.said();
    let revolution = stage.revolve(0.8, 0.1);
    let driven = stage.said();
    see(&mut stage, second(), &revolution.reflectors());
    let outputs = stage.localizer.outputs();
    assert_eq!((outputs.misuse, outputs.uses.len()), (Some(Misuse::UnknownLaser), 0));
    assert_eq!(outputs.pose.pose, driven.pose);
    assert_ne!(driven.pose, before.pose);
    let (ranges, intensities) = revolution.beams();
    let scan = agv_core::measurement::Scan { laser: second(), ..revolution.scan(&ranges, &intensities) };
    stage.localizer.handle(&Event::Scan(scan));
    assert_eq!(stage.localizer.outputs().misuse, Some(Misuse::UnknownLaser));
    assert_eq!((LaserId::new(2), LaserId::try_from(7).is_err()), (None, true));
}

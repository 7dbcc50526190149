//! An odometry that is not heard for a while, or not believed.

use agv_core::localizer::Mode;

use super::kind::Kind;
use super::run::{Course, course};
use super::simulator::{Drive, Outage, ramp, ring};

const SEEDS: u64 = 5;

/// Ways to go on when the odometry has gone.
#[derive(Clone, Copy, Debug)]
enum Then {
    Straight,
    IntoABend,
    Braking,
    Standing,
}

fn drive(kind: Kind, gyro: Option<f64>, outage: Outage, lasts: f64, then: Then, seed: u64) -> Course {
    let from = 10.0 + 0.013 * seed as f64;
    let motion = move |time: f64| {
        let speed = if matches!(then, Then::Standing) { 0.0 } else { ramp(time, 3.0, 1.5) };
        let after = (time - from).max(0.0);
        match then {
            Then::Straight | Then::Standing => (speed, 0.0, 0.0),
            Then::IntoABend => (speed, 0.0, after.min(0.4)),
            Then::Braking => ((speed - after).max(0.0), 0.0, 0.0),
        }
    };
    course(&Drive {
        gyro,
        seed,
        motion: Box::new(motion),
        seconds: from + lasts + 3.0,
        outage: Some((outage, from, lasts)),
        reflectors: ring(16, 6.0, 2.0, 16.0, seed),
        ..Drive::new(kind)
    })
}

#[test]
fn a_short_outage_of_the_odometry_loses_no_vehicle_among_reflectors() {
    let mut lost = Vec::new();
    for kind in [Kind::Tricycle, Kind::Differential, Kind::Mecanum, Kind::Increments] {
        for gyro in [None, Some(100.0)] {
            for (outage, lasts) in [(Outage::Silence, 0.3), (Outage::Silence, 1.0), (Outage::Faults, 0.2)] {
                for then in [Then::Straight, Then::IntoABend, Then::Braking] {
                    for seed in 1..=SEEDS {
                        let course = drive(kind, gyro, outage, lasts, then, seed);
                        if let Some((at, reason)) = course.lost {
                            lost.push(format!(
                                "{kind:?} {gyro:?} {outage:?} {lasts} {then:?} {seed}: {at:.2} {reason:?}"
                            ));
                        }
                        assert!(course.has(Mode::WithoutOdometry), "{kind:?} {outage:?} {lasts} {then:?}");
                        assert!(
                            matches!(course.modes.last(), Some((Mode::Reflectors, _))),
                            "{kind:?} {outage:?} {lasts} {then:?}: {:?}",
                            course.modes
                        );
                        assert_eq!(
                            course.above, 0,
                            "{kind:?} {gyro:?} {outage:?} {lasts} {then:?} {seed}: {}",
                            course.ratio
                        );
                    }
                }
            }
        }
    }
    assert!(lost.is_empty(), "{}: {lost:#?}", lost.len());
}

#[test]
fn two_seconds_without_odometry_lose_no_vehicle_among_reflectors() {
    for kind in [Kind::Tricycle, Kind::Differential, Kind::Omni4, Kind::Increments] {
        for then in [Then::Standing, Then::Straight] {
            for seed in 1..=3 {
                let course = drive(kind, None, Outage::Silence, 2.0, then, seed);
                assert_eq!(course.lost, None, "{kind:?} {then:?} {seed}");
                assert_eq!(course.above, 0, "{kind:?} {then:?} {seed}: {}", course.ratio);
            }
        }
    }
}

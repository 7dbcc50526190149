//! Logs that are not good enough: a reason each time, never a confident wrong number.

use agv_core::calibration::Unobservable;
use agv_core::geometry::Point;
use agv_core::localizer::Event;
use agv_core::measurement::{ReflectorObservation, Reflectors};
use agv_host_sim::calibrate::drive::{Drive, Preparation};
use agv_host_sim::calibrate::log_input::LogInput;
use agv_host_sim::calibrate::refusal::Refusal;
use agv_lab::evaluate::calibration::course::{Course, Disturbance, ReflectorMove};

use super::truth::{ATC, JOINT, STC, assert_honest, calibrate, course, segments, vehicle};

const QUESTIONS: [agv_host_sim::calibrate::found::Question; 3] = [STC, ATC, JOINT];

fn log() -> LogInput {
    course(4).log(&Disturbance::MILD, 1)
}

#[test]
fn a_log_without_motion_is_refused() {
    let mut log = log();
    let first = log.encoders[0];
    log.encoders.iter_mut().for_each(|sample| (sample.drive, sample.steering) = (first.drive, first.steering));
    for question in &QUESTIONS {
        assert_eq!(calibrate(&log, question).unwrap_err(), Refusal::NoMotion);
    }
    log.encoders.clear();
    assert_eq!(calibrate(&log, &JOINT).unwrap_err(), Refusal::NoEncoders);
}

#[test]
fn one_segment_is_not_enough() {
    let log = Course::new(vehicle(), &segments(4)[..1], 1.0, 1).log(&Disturbance::MILD, 1);
    for question in &QUESTIONS {
        assert_eq!(calibrate(&log, question).unwrap_err(), Refusal::TooFewSegments { found: 1, needed: 2 });
    }
}

#[test]
fn one_steering_angle_is_not_enough() {
    let all = segments(4);
    let forward = [all[0], all[0], all[0]];
    let log = Course::new(vehicle(), &forward, 1.0, 1).log(&Disturbance::MILD, 1);
    assert_eq!(calibrate(&log, &STC).unwrap_err(), Refusal::Unobservable(Unobservable::OneSteeringAngle));
    let words = Refusal::Unobservable(Unobservable::OneSteeringAngle).to_string();
    assert_eq!(words, "only one steering angle: the offset cannot be told from the scale");
    // Two angles, but forward only.
    let forward = [all[0], all[2], all[4], all[6]];
    let log = Course::new(vehicle(), &forward, 1.0, 1).log(&Disturbance::MILD, 1);
    let reason = calibrate(&log, &JOINT).unwrap_err();
    assert_eq!(reason, Refusal::Unobservable(Unobservable::OneSteeringAngleBackward));
}

/// Ticks at `rate` are added to the counter for each one that it counts, where `slips` says so of the way in ticks.
fn with_slip(log: &LogInput, rate: f64, slips: impl Fn(usize) -> bool) -> LogInput {
    let mut log = log.clone();
    let range = agv_core::odometry::CounterRange::BITS_16;
    let (mut added, mut segment, mut still) = (0.0, 0, 0);
    let mut last = log.encoders[0].drive;
    for sample in &mut log.encoders {
        let step = range.step(last, sample.drive);
        last = sample.drive;
        still = if step == 0 { still + 1 } else { 0 };
        // A second of standstill ends a segment.
        segment += usize::from(still == 50);
        if slips(segment) {
            added += rate * step as f64;
        }
        sample.drive = (i64::from(sample.drive) + added as i64).rem_euclid(65536) as u32;
    }
    log
}

#[test]
fn a_wheel_that_slips_in_half_of_the_drive_is_noticed() {
    let log = log();
    for rate in [0.3, 0.05, 0.02] {
        for slips in [|segment: usize| segment > 8, |segment: usize| segment % 2 == 1, |segment: usize| segment % 4 < 2]
        {
            for question in &QUESTIONS {
                let slipping = with_slip(&log, rate, slips);
                // Whoever gives a result nevertheless must state deviations that hold the truth.
                if let Ok(found) = calibrate(&slipping, question) {
                    assert_honest(&found, &vehicle());
                }
            }
            let reason = calibrate(&with_slip(&log, rate, slips), &JOINT);
            assert!(reason.is_err(), "{rate}: {reason:?}");
        }
    }
}

#[test]
fn one_segment_that_slips_is_named_and_left_out() {
    let log = with_slip(&log(), 0.02, |segment| segment == 5);
    for question in [ATC, JOINT] {
        let found = calibrate(&log, &question).unwrap();
        assert_eq!(found.outliers().count(), 1);
        assert_honest(&found, &vehicle());
    }
}

#[test]
fn reflectors_that_were_moved_are_noticed() {
    // Each reflector is somewhere else after each segment.
    let scattered = Disturbance { lasting_reflector_error: 0.05, ..Disturbance::MILD };
    let log = course(4).log(&scattered, 1);
    for question in &QUESTIONS {
        let reason = calibrate(&log, question).unwrap_err();
        assert!(matches!(reason, Refusal::ReflectorsMoved { .. }), "{reason}");
    }
    // Half of them, once, all by the same shift: a motion that never was.
    let moves: Vec<ReflectorMove> = (0..8)
        .map(|reflector| ReflectorMove { reflector: 2 * reflector, time: 150.0, shift: Point::new(0.1, 0.05) })
        .collect();
    let log = Course::with_moved_reflectors(vehicle(), &segments(4), 1.0, 1, &moves).log(&Disturbance::MILD, 1);
    let drive = Drive::new(&log, &Preparation::default()).unwrap();
    assert!(drive.remarks.iter().any(|remark| remark.contains("reflectors")), "{:?}", drive.remarks);
    assert_honest(&calibrate(&log, &JOINT).unwrap(), &vehicle());
}

#[test]
fn reflectors_that_are_no_numbers_are_noticed() {
    let good = log();
    let spoilt = |share: usize| {
        let mut log = LogInput { revolutions: Vec::new(), ..good.clone() };
        for revolution in &good.revolutions {
            let spoil = |(index, seen): (usize, &ReflectorObservation)| ReflectorObservation {
                range: if index % share == 0 { f32::NAN } else { seen.range },
                ..*seen
            };
            let observations: Vec<_> = revolution.iter().enumerate().map(spoil).collect();
            log.add(&Event::Reflectors(Reflectors::of_first(&observations)));
        }
        log
    };
    let reason = calibrate(&spoilt(1), &JOINT).unwrap_err();
    assert!(matches!(reason, Refusal::NoNumbers(count) if count > 1000), "{reason}");
    let log = spoilt(4);
    let drive = Drive::new(&log, &Preparation::default()).unwrap();
    assert!(drive.remarks.iter().any(|remark| remark.contains("no numbers")), "{:?}", drive.remarks);
    assert_honest(&calibrate(&log, &JOINT).unwrap(), &vehicle());
    let mut log = good;
    log.revolutions.clear();
    assert_eq!(calibrate(&log, &JOINT).unwrap_err(), Refusal::NoLaserMotion);
}

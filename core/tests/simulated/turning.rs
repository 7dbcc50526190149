//! Turns: on the spot, in circles, and with a gyro.

use std::f64::consts::FRAC_PI_2;

use agv_core::localizer::{Localizer, Reason, VehicleCapacities};

use super::kind::Kind;
use super::run::{course, course_by};
use super::simulator::{Drive, Errors, ramp, ring};

const RATE: f64 = 0.4;

#[test]
fn a_quarter_of_a_turn_on_the_spot_that_is_reported_too_large_loses_no_vehicle() {
    for error in [-0.006, 0.003, 0.006] {
        for seed in 1..=5 {
            let turning = |time: f64| (0.0, 0.0, if time > 8.0 && time < 8.0 + FRAC_PI_2 / RATE { RATE } else { 0.0 });
            let course = course(&Drive {
                motion: Box::new(turning),
                seconds: 14.0,
                seed,
                reflectors: ring(8, 0.0, 0.0, 9.0, seed),
                errors: Errors { turn: error, ..Errors::SMALL },
                ..Drive::new(Kind::Increments)
            });
            assert_eq!(course.lost, None, "{error} {seed}");
            assert_eq!(course.above, 0, "{error} {seed}: {}", course.ratio);
        }
    }
}

#[test]
fn circles_among_reflectors_have_no_wide_level() {
    let mut wide = Vec::new();
    for kind in [Kind::Tricycle, Kind::Differential, Kind::Omni4, Kind::Increments] {
        for radius in [1.8, 4.0, 8.0] {
            let turning = move |time: f64| {
                let speed = 0.8 * ramp(time, 6.0, 1.5);
                (speed, 0.0, speed / radius)
            };
            let drive = Drive {
                motion: Box::new(turning),
                seconds: 60.0,
                reflectors: ring(22, 0.0, radius, 16.0, 11),
                ..Drive::new(kind)
            };
            let course = course(&drive);
            assert_eq!((course.lost, course.above), (None, 0), "{kind:?} {radius}");
            if course.wide > 0 {
                wide.push(format!("{kind:?} r {radius}: {} of {}", course.wide, course.outputs));
            }
        }
    }
    assert!(wide.is_empty(), "{wide:#?}");
}

#[test]
fn slalom_has_a_wide_level_hardly_ever() {
    for kind in [Kind::Tricycle, Kind::Differential, Kind::Omni3, Kind::Omni4, Kind::Mecanum] {
        for seed in 1..=3 {
            let winding = |time: f64| {
                let speed = 0.8 * ramp(time, 6.0, 1.0);
                (speed, 0.0, if time > 6.0 { 0.3 * (0.2 * (time - 6.0)).sin() } else { 0.0 })
            };
            let course = course(&Drive {
                motion: Box::new(winding),
                seconds: 60.0,
                seed,
                reflectors: ring(40, 15.0, 5.0, 24.0, seed),
                ..Drive::new(kind)
            });
            let share = course.wide as f64 / course.outputs as f64;
            assert!(share <= 0.004, "{kind:?} {seed}: {share}");
        }
    }
}

/// Every rate and latency that the settings allow, and wheels that come later than the gyro: its turn is used, or its fault is told.
#[test]
fn a_gyro_is_used_whatever_its_rate_and_latency_or_its_fault_is_told() {
    let mut unused = Vec::new();
    for (rate, latency, wheels, delay) in [
        (100.0, 0.0, 100.0, 0.002),
        (100.0, 0.06, 100.0, 0.002),
        (100.0, 0.2, 100.0, 0.002),
        (1000.0, 0.0, 50.0, 0.02),
        (1000.0, 0.0, 100.0, 0.09),
        (1000.0, 0.2, 1000.0, 0.002),
        (500.0, 0.1, 20.0, 0.09),
        (50.0, 0.0, 100.0, 0.002),
        (20.0, 0.0, 100.0, 0.002),
        (20.0, 0.2, 50.0, 0.002),
        (10.0, 0.0, 100.0, 0.002),
        (5.0, 0.0, 100.0, 0.002),
        (2.0, 0.0, 50.0, 0.002),
    ] {
        let drive = Drive {
            rate: wheels,
            delay,
            gyro: Some(rate),
            gyro_latency: latency,
            motion: Box::new(|time| (ramp(time, 1.0, 1.0), 0.0, 0.3 * ramp(time, 1.0, 1.0))),
            seconds: 12.0,
            reflectors: ring(8, 0.0, 3.0, 15.0, 1),
            ..Drive::new(Kind::Differential)
        };
        let (mut used, mut faults, mut outputs_since, mut last) = (0, 0, 0, None);
        const SINCE: f64 = 2.5;
        let localizer = Box::new(Localizer::<VehicleCapacities>::new(drive.parameters()));
        let (course, _) = course_by(&drive, localizer, |arrival, outputs| {
            if arrival < SINCE {
                return;
            }
            let told = outputs.sources.gyro.told;
            used += usize::from(told != last);
            last = told;
            outputs_since += 1;
            faults += usize::from(outputs.pose.reason == Reason::GyroFault);
        });
        let motions = (wheels * (drive.seconds - SINCE)) as i32;
        assert_eq!((course.lost, course.above), (None, 0), "{rate} Hz, {latency} s");
        let used = used as f64 / f64::from(motions);
        let faults = faults as f64 / f64::from(outputs_since);
        if used < 0.98 && faults < 0.99 {
            unused.push(format!(
                "gyro {rate} Hz {latency} s, wheels {wheels} Hz late {delay}: used {used:.3}, fault {faults:.3}"
            ));
        }
    }
    assert!(unused.is_empty(), "{unused:#?}");
}

/// The predictor is given the same reports as the localiser: where both are at the same time, it says the same, and claims no more.
#[test]
fn the_predictor_agrees_with_the_localiser_and_claims_no_smaller_level() {
    let mut apart = Vec::new();
    for kind in Kind::ALL {
        for gyro in [None, Some(100.0)] {
            for spot in [false, true] {
                if spot && !kind.turns_on_the_spot() {
                    continue;
                }
                let motion = move |time: f64| {
                    let ramp = ramp(time, 2.0, 1.5);
                    if spot { (0.0, 0.0, 0.6 * ramp) } else { (1.2 * ramp, 0.0, 0.35 * ramp * (0.45 * time).sin()) }
                };
                let course = course(&Drive {
                    gyro,
                    motion: Box::new(motion),
                    seconds: 20.0,
                    reflectors: ring(16, 6.0, 0.0, 18.0, 3),
                    ..Drive::new(kind)
                });
                let ((position, heading), (below, heading_below)) = (course.predictor_off, course.predictor_below);
                if position > 2e-3
                    || heading > 5e-4
                    || below > 2e-3
                    || heading_below > 4e-3
                    || course.above_predicted > 0
                {
                    apart.push(format!(
                        "{kind:?} gyro {gyro:?} spot {spot}: off {position:.4} m {heading:.5} rad, level below by {below:.4} m {heading_below:.5} rad, above {}",
                        course.above_predicted
                    ));
                }
            }
        }
    }
    assert!(apart.is_empty(), "{apart:#?}");
}

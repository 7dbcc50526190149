//! Faults of the encoders that real logs have.

use agv_core::odometry::{CounterRange, Tricycle, Vehicle};
use agv_host_sim::calibrate::counted::CounterFault;
use agv_host_sim::calibrate::drive::{Drive, Preparation};
use agv_host_sim::calibrate::found::find;
use agv_host_sim::calibrate::log_input::LogInput;
use agv_host_sim::calibrate::refusal::Refusal;
use agv_lab::evaluate::calibration::course::{Course, Disturbance, TrueVehicle};

use super::truth::{JOINT, assert_honest, segments, vehicle};

fn long_counter() -> TrueVehicle {
    let vehicle = vehicle();
    TrueVehicle { tricycle: Tricycle { drive_range: CounterRange::BITS_32, ..vehicle.tricycle }, ..vehicle }
}

fn log() -> LogInput {
    Course::new(long_counter(), &segments(4), 1.0, 1).log(&Disturbance::MILD, 1)
}

const MEND: Preparation = Preparation { map: None, mend: true };

/// Indices of samples in the middle of a motion, far from each other.
fn moving(log: &LogInput) -> Vec<usize> {
    let speed = |index: &usize| {
        let step = |index: usize| i64::from(log.encoders[index + 1].drive) - i64::from(log.encoders[index].drive);
        (index - 60..index + 60).all(|index| step(index).abs() > 20)
    };
    let mut found: Vec<usize> = Vec::new();
    for index in (60..log.encoders.len() - 61).filter(speed) {
        if found.last().is_none_or(|last| index > last + 500) {
            found.push(index);
        }
    }
    found
}

#[test]
fn aliases_of_the_lower_half_are_found_and_mended() {
    let mut log = log();
    let places: Vec<usize> = moving(&log).into_iter().take(3).collect();
    for (count, place) in places.iter().enumerate() {
        let missing = 65536 * (1 + count as u32 % 2);
        log.encoders[*place..].iter_mut().for_each(|sample| sample.drive = sample.drive.wrapping_sub(missing));
    }
    let drive = Drive::new(&log, &MEND).unwrap();
    let aliases: Vec<_> = drive
        .faults
        .iter()
        .filter_map(
            |fault| if let CounterFault::Alias { time, missing } = fault { Some((*time, *missing)) } else { None },
        )
        .collect();
    let expected: Vec<_> = places
        .iter()
        .enumerate()
        .map(|(count, place)| (log.encoders[*place].time, 65536.0 * (1 + count % 2) as f64))
        .collect();
    assert_eq!(aliases, expected);
    assert_honest(&find(&drive, &JOINT).unwrap(), &long_counter());
    // Left alone, they are reported, and what they spoil is left out or refused.
    let drive = Drive::new(&log, &Preparation::default()).unwrap();
    assert!(drive.faults.len() >= 3);
    if let Ok(found) = find(&drive, &JOINT) {
        assert_honest(&found, &long_counter());
    }
}

#[test]
fn freezes_with_catching_up_are_found_and_mended() {
    let mut log = log();
    let places: Vec<usize> = moving(&log).into_iter().take(4).collect();
    for place in &places {
        let held = log.encoders[*place].drive;
        log.encoders[*place..*place + 6].iter_mut().for_each(|sample| sample.drive = held);
    }
    let drive = Drive::new(&log, &MEND).unwrap();
    let freezes = drive.faults.iter().filter(|fault| matches!(fault, CounterFault::Freeze { .. })).count();
    assert_eq!(freezes, places.len(), "{:?}", drive.faults);
    assert_honest(&find(&drive, &JOINT).unwrap(), &long_counter());
}

#[test]
fn a_counter_that_counts_the_wrong_way_is_found_and_mended() {
    for is_steering in [false, true] {
        let mut log = log();
        let Vehicle::Tricycle(tricycle) = log.parameters.vehicle else { panic!() };
        for sample in &mut log.encoders {
            if is_steering {
                let range = tricycle.steering_range.values() as u32;
                sample.steering = (range - sample.steering) % range;
            } else {
                sample.drive = sample.drive.wrapping_neg();
            }
        }
        let reason = Drive::new(&log, &Preparation::default()).unwrap_err();
        assert!(matches!(reason, Refusal::WrongDirection(_)), "{reason}");
        let drive = Drive::new(&log, &MEND).unwrap();
        assert!(drive.faults.contains(&CounterFault::WrongDirection { is_steering }), "{:?}", drive.faults);
        let found = find(&drive, &JOINT).unwrap();
        assert_honest(&found, &long_counter());
    }
}

//! Mistakes of hands, and logs in which they are undone.

use std::f64::consts::PI;

use agv_core::geometry::wrap;
use agv_core::odometry::{Counted, Vehicle, WheelVehicle};

use super::Mistake;
use crate::calibrate::log_input::LogInput;
use crate::calibrate::wheeled::fitted_vehicle::with_counter_scale;

/// Steering offsets that are tried, in eighths of a turn.
const EIGHTHS: i32 = 8;

/// What is undone before the fit.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Undone {
    pub mistakes: Vec<Mistake>,
    pub input: LogInput,
}

/// Nothing undone, each mistake of hands, and each pair of them.
pub(super) fn hypotheses(input: &LogInput) -> Vec<Undone> {
    let none = Undone { mistakes: Vec::new(), input: input.clone() };
    let counters = input.parameters.vehicle.counters();
    let wheels: Vec<usize> =
        counters.iter().filter(|counter| counter.counted == Counted::Turn).map(|counter| counter.wheel).collect();
    let mut single: Vec<Mistake> =
        counters.iter().map(|counter| Mistake::Reversed { wheel: counter.wheel, counted: counter.counted }).collect();
    if wheels.len() > 1 {
        single.push(Mistake::AllReversed);
    }
    for (index, first) in wheels.iter().enumerate() {
        single.extend(wheels[index + 1..].iter().map(|second| Mistake::Swapped(*first, *second)));
    }
    for counter in counters.iter().filter(|counter| counter.counted == Counted::Steering) {
        let offset = |eighth: i32| {
            Mistake::SteeringOffset(counter.wheel, wrap(f64::from(eighth) * 2.0 * PI / f64::from(EIGHTHS)))
        };
        single.extend((1..EIGHTHS).map(offset));
    }
    let undone = |mistakes: &[Mistake]| {
        let mut right = input.clone();
        mistakes
            .iter()
            .all(|mistake| undo(&mut right, mistake))
            .then(|| Undone { mistakes: mistakes.to_vec(), input: right })
    };
    let mut all = vec![none];
    all.extend(single.iter().filter_map(|one| undone(std::slice::from_ref(one))));
    for (index, first) in single.iter().enumerate() {
        let pairs = single[index + 1..].iter().filter(|second| !is_one(first, second));
        all.extend(pairs.filter_map(|second| undone(&[first.clone(), second.clone()])));
    }
    all
}

/// Whether two mistakes are of one thing.
fn is_one(first: &Mistake, second: &Mistake) -> bool {
    use Mistake::{AllReversed, Reversed, SteeringOffset};
    match (first, second) {
        (SteeringOffset(a, _), SteeringOffset(b, _)) => a == b,
        (AllReversed, Reversed { counted: Counted::Turn, .. })
        | (Reversed { counted: Counted::Turn, .. }, AllReversed) => true,
        _ => false,
    }
}

/// Undoes a mistake in what is believed, or in what was counted. False if the vehicle has no such thing.
fn undo(input: &mut LogInput, mistake: &Mistake) -> bool {
    match mistake {
        Mistake::Reversed { wheel, counted } => {
            with_counter_scale(&mut input.parameters.vehicle, *wheel, *counted, |scale| -scale)
        }
        Mistake::AllReversed => {
            let counters = input.parameters.vehicle.counters();
            let mut turns = counters.iter().filter(|counter| counter.counted == Counted::Turn);
            turns.all(|counter| {
                with_counter_scale(&mut input.parameters.vehicle, counter.wheel, Counted::Turn, |scale| -scale)
            })
        }
        Mistake::Swapped(first, second) => {
            input.wheels.iter_mut().for_each(|sample| {
                let count = sample.wheels[*first].count;
                sample.wheels[*first].count = sample.wheels[*second].count;
                sample.wheels[*second].count = count;
            });
            !input.wheels.is_empty()
        }
        Mistake::SteeringOffset(wheel, angle) => turn_steering(&mut input.parameters.vehicle, *wheel, *angle),
        _ => false,
    }
}

fn turn_steering(vehicle: &mut Vehicle, wheel: usize, angle: f64) -> bool {
    match vehicle {
        Vehicle::Tricycle(tricycle) => {
            tricycle.steering_offset_forward = wrap(tricycle.steering_offset_forward + angle);
            tricycle.steering_offset_backward = wrap(tricycle.steering_offset_backward + angle);
            true
        }
        Vehicle::Wheels(WheelVehicle::Ackermann(car)) => {
            car.steering_offset = wrap(car.steering_offset + angle);
            true
        }
        Vehicle::Wheels(WheelVehicle::BiSteerable(vehicle)) => {
            let steered = if wheel == 0 { &mut vehicle.front } else { &mut vehicle.rear };
            steered.steering_offset = wrap(steered.steering_offset + angle);
            true
        }
        _ => false,
    }
}

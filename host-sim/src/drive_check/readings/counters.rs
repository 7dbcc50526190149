//! Counters of encoders.

use agv_core::localizer::Parameters;
use agv_core::measurement::WheelSample;
use agv_core::odometry::{Counted, Counter};

use super::{CATCH_UP, FEWEST, Moving, Wrong, wheel_sample};
use crate::recording::RecordedEvent;

pub(super) fn wrong(parameters: &Parameters, events: &[&RecordedEvent], moving: &Moving) -> Vec<Wrong> {
    let samples: Vec<WheelSample> = events.iter().filter_map(|event| wheel_sample(event)).collect();
    let counters = parameters.vehicle.counters();
    let mut wrong = Vec::new();
    for counter in &counters {
        let name = counter_name(parameters, counter);
        let values = counter.range.values();
        let beyond = samples.iter().filter(|sample| u64::from(sample.count(counter)) >= values).count();
        wrong.push((
            beyond,
            format!("show counts of {name} beyond its range of {values}"),
            format!("look at the encoder's number of positions: {}", setting(parameters, counter, "counter_values")),
        ));
        if counter.counted == Counted::Steering {
            continue;
        }
        let steps: Vec<(f64, f64)> = samples
            .windows(2)
            .map(|pair| {
                let way =
                    counter.scale.abs() * counter.range.step(pair[0].count(counter), pair[1].count(counter)) as f64;
                (way.abs(), pair[1].time.since(pair[0].time))
            })
            .filter(|(_, time)| *time > 0.0)
            .collect();
        let fastest = |time: f64| parameters.limits.fastest * (time + CATCH_UP);
        let jumps = steps.iter().filter(|(way, time)| *way > fastest(*time)).count();
        wrong.push((
            jumps,
            format!("jump at {name} by more than the vehicle can move"),
            format!(
                "look at the encoder, its cable and the scale of a tick: {}",
                setting(parameters, counter, "scale")
            ),
        ));
        let others_move =
            moving.laser || counters.iter().any(|other| other.wheel != counter.wheel && goes(&samples, other, LITTLE));
        let stands =
            usize::from(samples.len() >= FEWEST && !goes(&samples, counter, LITTLE) && others_move) * samples.len();
        wrong.push((
            stands,
            format!("show a count of {name} that stands still while the vehicle moves"),
            "look at the encoder's coupling, and at which node is which wheel: agv can monitor can0".to_owned(),
        ));
    }
    wrong
}

/// A wheel that goes less far stands, m.
const LITTLE: f64 = 0.05;

/// Whether a wheel has gone so far, m, to and fro.
pub(super) fn goes(samples: &[WheelSample], counter: &Counter, way: f64) -> bool {
    let steps = samples.windows(2).map(|pair| counter.range.step(pair[0].count(counter), pair[1].count(counter)));
    counter.counted == Counted::Turn && steps.map(i64::abs).sum::<i64>() as f64 * counter.scale.abs() > way
}

fn is_tricycle(parameters: &Parameters) -> bool {
    matches!(parameters.vehicle, agv_core::odometry::Vehicle::Tricycle(_))
}

fn counter_name(parameters: &Parameters, counter: &Counter) -> String {
    match (is_tricycle(parameters), counter.counted) {
        (true, Counted::Turn) => "the driving wheel".to_owned(),
        (true, Counted::Steering) => "the steering".to_owned(),
        (false, Counted::Turn) => format!("wheel {}", counter.wheel + 1),
        (false, Counted::Steering) => format!("the steering of wheel {}", counter.wheel + 1),
    }
}

/// The setting of a counter: of its range, or of its tick.
fn setting(parameters: &Parameters, counter: &Counter, what: &str) -> String {
    let of = match (is_tricycle(parameters), counter.counted) {
        (true, Counted::Turn) => "drive".to_owned(),
        (true, Counted::Steering) => "steering".to_owned(),
        (false, Counted::Turn) => format!("wheel_{}", counter.wheel + 1),
        (false, Counted::Steering) => format!("wheel_{}_steering", counter.wheel + 1),
    };
    format!("agv settings vehicle.{of}_{what}")
}

//! Motion that the vehicle reports in physical units, and the gyro.

use agv_core::localizer::{AnyEvent, Parameters};

use super::{CATCH_UP, FEWEST, Moving, STILL, STUCK, Wrong, longest_run};
use crate::drive_check::stream::Stream;
use crate::recording::RecordedEvent;

pub(super) fn speeds(parameters: &Parameters, events: &[&RecordedEvent], moving: &Moving) -> Vec<Wrong> {
    let samples =
        || events.iter().filter_map(|event| if let AnyEvent::Speed(sample) = event { Some(sample) } else { None });
    let count = |is: &dyn Fn(f64, f64) -> bool| samples().filter(|one| is(one.speed, one.steering)).count();
    let all = events.len();
    let fastest = parameters.limits.fastest;
    let stands = usize::from(all >= FEWEST && moving.laser && count(&|speed, _| speed.abs() > STILL) == 0) * all;
    vec![
        (
            count(&|speed, steering| !speed.is_finite() || !steering.is_finite()),
            "are no numbers".to_owned(),
            String::new(),
        ),
        (
            count(&|speed, _| speed.is_finite() && speed.abs() > fastest),
            format!("are faster than {fastest} m/s"),
            "look at the unit of the speed: m/s is wanted".to_owned(),
        ),
        (
            count(&|_, steering| steering.is_finite() && steering.abs() > std::f64::consts::PI),
            "have steering angles of more than half a turn".to_owned(),
            "look at the unit of the steering angle: radians are wanted".to_owned(),
        ),
        (stands, "say that the vehicle stands while the laser sees it move".to_owned(), String::new()),
    ]
}

pub(super) fn increments(
    parameters: &Parameters,
    events: &[&RecordedEvent],
    stream: &Stream,
    moving: &Moving,
) -> Vec<Wrong> {
    let samples =
        || events.iter().filter_map(|event| if let AnyEvent::Increment(one) = event { Some(one) } else { None });
    let all = events.len();
    let fastest = parameters.limits.fastest * (stream.interval().unwrap_or(1.0) + CATCH_UP);
    let way = |one: &agv_core::measurement::PoseIncrement| one.displacement.position().norm();
    let is_still = samples().all(|one| one.displacement.is_finite() && way(one) < 1e-4);
    vec![
        (samples().filter(|one| !one.displacement.is_finite()).count(), "are no numbers".to_owned(), String::new()),
        (
            samples().filter(|one| way(one) > fastest).count(),
            format!("are faster than {} m/s", parameters.limits.fastest),
            "look at the unit: metres are wanted, and motions from one sample to the next rather than poses".to_owned(),
        ),
        (
            usize::from(all >= FEWEST && is_still && moving.laser) * all,
            "say that the vehicle stands while the laser sees it move".to_owned(),
            String::new(),
        ),
    ]
}

pub(super) fn gyro(parameters: &Parameters, events: &[&RecordedEvent], moving: &Moving) -> Vec<Wrong> {
    let rates: Vec<f64> =
        events.iter().filter_map(|event| if let AnyEvent::Gyro(one) = event { Some(one.rate) } else { None }).collect();
    let same = longest_run(&rates, |a, b| a == b);
    let is_stuck = moving.odometry && rates.len() >= FEWEST && same as f64 > STUCK * rates.len() as f64;
    vec![
        (rates.iter().filter(|rate| !rate.is_finite()).count(), "are no numbers".to_owned(), String::new()),
        (
            rates.iter().filter(|rate| rate.abs() > parameters.gyro.range).count(),
            format!("are beyond the gyro's range of {:.0} deg/s", parameters.gyro.range.to_degrees()),
            "look at the unit: agv settings gyro".to_owned(),
        ),
        (usize::from(is_stuck) * same, "are one value again and again".to_owned(), String::new()),
        (
            usize::from(!parameters.gyro.is_fitted) * rates.len(),
            "are not used: by the settings the vehicle has no gyro".to_owned(),
            "agv settings gyro.fitted".to_owned(),
        ),
    ]
}

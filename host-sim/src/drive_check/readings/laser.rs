//! What lasers see.

use agv_core::localizer::AnyEvent;

use super::{FEWEST, Moving, STUCK, Wrong, longest_run};
use crate::recording::{RecordedEvent, RecordedReflectors, RecordedScan};

/// Ranges beyond it are no metres.
const FARTHEST: f32 = 1000.0;

pub(super) fn reflectors(events: &[&RecordedEvent], moving: &Moving) -> Vec<Wrong> {
    let all: Vec<&RecordedReflectors> = events
        .iter()
        .filter_map(|event| if let AnyEvent::Reflectors(seen) = event { Some(seen) } else { None })
        .collect();
    let count = |is: &dyn Fn(&RecordedReflectors) -> bool| all.iter().filter(|seen| is(seen)).count();
    let is_no_number = |seen: &RecordedReflectors| {
        seen.observations.iter().any(|one| !one.range.is_finite() || !one.bearing.is_finite() || one.range < 0.0)
    };
    let is_far = |seen: &RecordedReflectors| seen.observations.iter().any(|one| one.range > FARTHEST);
    let is_mixed = |seen: &RecordedReflectors| seen.observations.windows(2).any(|pair| pair[1].time < pair[0].time);
    let places = |seen: &RecordedReflectors| {
        seen.observations.iter().map(|one| (one.range.to_bits(), one.bearing.to_bits())).collect::<Vec<_>>()
    };
    let same = longest_run(&all, |a, b| !a.observations.is_empty() && places(a) == places(b));
    let is_stuck = moving.odometry && all.len() >= FEWEST && same as f64 > STUCK * all.len() as f64;
    vec![
        (count(&is_no_number), "hold ranges or bearings that are no numbers".to_owned(), String::new()),
        (
            count(&is_far),
            format!("hold ranges of more than {FARTHEST} m"),
            "look at the unit of the ranges: metres are wanted".to_owned(),
        ),
        (count(&is_mixed), "are not in order of time within themselves".to_owned(), String::new()),
        (usize::from(is_stuck) * same, "are the same one again and again".to_owned(), String::new()),
        (
            usize::from(all.iter().all(|seen| seen.observations.is_empty())) * all.len(),
            "are empty".to_owned(),
            "look at the sensor's layout, its reflectors' size and what it counts as one".to_owned(),
        ),
    ]
}

pub(super) fn scans(events: &[&RecordedEvent], moving: &Moving) -> Vec<Wrong> {
    let all: Vec<&RecordedScan> =
        events.iter().filter_map(|event| if let AnyEvent::Scan(scan) = event { Some(scan) } else { None }).collect();
    let count = |is: &dyn Fn(&RecordedScan) -> bool| all.iter().filter(|scan| is(scan)).count();
    let is_return = |range: &f32| range.is_finite() && *range > 0.0;
    let is_empty = |scan: &RecordedScan| !scan.ranges.iter().any(is_return);
    let is_far = |scan: &RecordedScan| {
        let returns = || scan.ranges.iter().filter(|range| is_return(range));
        returns().filter(|range| **range > FARTHEST).count() * 2 > returns().count()
    };
    let is_bent = |scan: &RecordedScan| {
        let RecordedScan { beam_interval, first_bearing, bearing_step, ranges, .. } = scan;
        let turn = bearing_step.abs() * ranges.len() as f64;
        let is_turn = turn > 0.0 && turn <= std::f64::consts::TAU * 1.01;
        !(first_bearing.is_finite() && is_turn && *beam_interval >= 0.0 && beam_interval.is_finite())
    };
    let same = longest_run(&all, |a, b| !is_empty(a) && a.ranges == b.ranges);
    let is_stuck = moving.odometry && all.len() >= FEWEST && same as f64 > STUCK * all.len() as f64;
    let overlap = all.windows(2).filter(|pair| pair[0].view().end() > pair[1].start && pair[1].start > pair[0].start);
    let unequal = |scan: &RecordedScan| !scan.intensities.is_empty() && scan.intensities.len() != scan.ranges.len();
    vec![
        (count(&is_empty), "have no return at all".to_owned(), "look at the window, and at what is near it".to_owned()),
        (
            count(&is_far),
            format!("hold ranges of more than {FARTHEST} m"),
            "look at the unit: metres are wanted".to_owned(),
        ),
        (
            count(&is_bent),
            "have beams that lie in no turn: their number, their angle or their time cannot be".to_owned(),
            "look at the angles and at the time of a beam where the scans come from".to_owned(),
        ),
        (
            overlap.count(),
            "last longer than it takes to the next one".to_owned(),
            "look at the time of a beam where the scans come from".to_owned(),
        ),
        (count(&unequal), "have another number of strengths than of ranges".to_owned(), String::new()),
        (usize::from(is_stuck) * same, "are the same one again and again".to_owned(), String::new()),
    ]
}

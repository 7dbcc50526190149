//! The laser's motion from stop to stop (K 5.2).

use std::collections::BTreeMap;

use agv_core::calibration::{Registered, Registration};
use agv_core::geometry::Point;
use nalgebra::{Matrix3, Vector3};

use super::counted::Counted;
use super::standstill::Standstill;
use super::tracking::TrackedRevolution;
use super::window::Window;
use super::windows::steps_between;

/// A standstill and what was seen from it.
#[derive(Clone, Debug, PartialEq)]
pub struct Stop {
    /// When.
    pub standstill: Standstill,
    /// Mean place of each reflector in S, by name, m.
    pub points: BTreeMap<usize, Point>,
    /// Revolutions of the standstill.
    pub revolutions: usize,
}

/// A reflector counts at a stop if it was seen in this share of its revolutions.
const SMALLEST_SHARE: f64 = 0.3;
/// Sightings further than this from the median, m, are of something else.
const LARGEST_SCATTER: f64 = 0.06;

/// Averages what was seen at each standstill.
#[must_use]
pub fn stops(standstills: &[Standstill], revolutions: &[TrackedRevolution]) -> Vec<Stop> {
    standstills.iter().map(|standstill| stop(standstill, revolutions)).filter(|stop| stop.points.len() >= 2).collect()
}

fn stop(standstill: &Standstill, revolutions: &[TrackedRevolution]) -> Stop {
    let first = revolutions.partition_point(|revolution| revolution.time < standstill.start);
    let last = revolutions.partition_point(|revolution| revolution.time <= standstill.end).max(first);
    let mut seen: BTreeMap<usize, Vec<Point>> = BTreeMap::new();
    for revolution in &revolutions[first..last] {
        for sighting in &revolution.sightings {
            if sighting.time >= standstill.start && sighting.time <= standstill.end {
                seen.entry(sighting.reflector).or_default().push(sighting.point);
            }
        }
    }
    let fewest = (SMALLEST_SHARE * (last - first) as f64).max(1.0);
    seen.retain(|_, points| points.len() as f64 >= fewest);
    let points = seen.into_iter().filter_map(|(name, points)| Some((name, centre(&points)?))).collect();
    Stop { standstill: *standstill, points, revolutions: last - first }
}

/// Mean of the points near their median.
fn centre(points: &[Point]) -> Option<Point> {
    let median = |coordinate: usize| {
        let mut values: Vec<f64> = points.iter().map(|point| point[coordinate]).collect();
        let middle = values.len() / 2;
        *values.select_nth_unstable_by(middle, f64::total_cmp).1
    };
    let median = Point::new(median(0), median(1));
    let near = || points.iter().filter(|point| (*point - median).norm() < LARGEST_SCATTER);
    let count = near().count();
    (count > 0).then(|| near().fold(Point::zeros(), |sum, point| sum + point) / count as f64)
}

/// What became of the way between two stops.
#[derive(Clone, Debug)]
pub enum Between {
    /// The laser's motion is known; with the names of reflectors that have moved meanwhile.
    Window(Window, Vec<usize>),
    /// The driving wheel has hardly moved.
    Rest,
    /// The vehicle went forth and back without a stop.
    Reversal,
    /// Too few reflectors were seen from both stops.
    FewReflectors,
    /// The reflectors do not agree on a motion.
    Disagreement,
}

/// Pairs that a motion needs.
const FEWEST_PAIRS: usize = 3;
/// A reflector has moved if it is off by so many deviations of the others, and by so much, m.
const MOVED_DEVIATIONS: f64 = 4.5;
const MOVED_DISTANCE: f64 = 0.008;
/// Share of the reflectors that may have moved.
const LARGEST_MOVED_SHARE: f64 = 0.34;
/// Larger differences between the places of reflectors, m, are no noise.
const LARGEST_DEVIATION: f64 = 0.02;
/// Smallest deviation of a coordinate that a registration is trusted to have, m: lasers report whole millimetres, and the
/// wheel is counted in whole ticks.
const SMALLEST_DEVIATION: f64 = 4e-4;
/// Share of the way against the sense of travel that is still taken as play.
const LARGEST_BACKLASH: f64 = 0.02;

/// The way from one stop to the next; fewer ticks than `shortest` are no way.
#[must_use]
pub fn between(counted: &[Counted], first: &Stop, second: &Stop, shortest: f64) -> Between {
    let (start, end) = (first.standstill.middle(), second.standstill.middle());
    let steps = steps_between(counted, start, end).finish();
    let way: f64 = steps.iter().map(|step| step.ticks).sum();
    let travelled: f64 = steps.iter().map(|step| step.ticks.abs()).sum();
    if travelled < shortest {
        return Between::Rest;
    }
    if travelled - way.abs() > 2.0 * LARGEST_BACKLASH * travelled {
        return Between::Reversal;
    }
    let mut pairs: Vec<(usize, Point, Point)> = first
        .points
        .iter()
        .filter_map(|(name, point)| Some((*name, *point, *second.points.get(name)?)))
        .collect();
    let mut moved = Vec::new();
    let allowed = (LARGEST_MOVED_SHARE * pairs.len() as f64) as usize;
    loop {
        let mut registration = Registration::default();
        pairs.iter().for_each(|(_, first, second)| registration.add(first, second));
        let Some(found) = registration.solve().filter(|found| found.pairs >= FEWEST_PAIRS) else {
            return Between::FewReflectors;
        };
        let residual =
            |(_, first, second): &(usize, Point, Point)| (found.pose.transform(second) - first).norm();
        let mut residuals: Vec<f64> = pairs.iter().map(residual).collect();
        let worst = (0..residuals.len()).max_by(|a, b| residuals[*a].total_cmp(&residuals[*b])).unwrap_or(0);
        let largest = residuals[worst];
        let middle = residuals.len() / 2;
        let typical = *residuals.select_nth_unstable_by(middle, f64::total_cmp).1;
        if largest > MOVED_DISTANCE && largest > MOVED_DEVIATIONS * typical && moved.len() < allowed {
            moved.push(pairs.remove(worst).0);
            continue;
        }
        if found.deviation > LARGEST_DEVIATION {
            return Between::Disagreement;
        }
        let centre = pairs.iter().fold(Point::zeros(), |sum, pair| sum + pair.2) / pairs.len() as f64;
        let covariance = registered_covariance(&found, &centre);
        return Between::Window(Window { start, end, steps, motion: found.pose, covariance }, moved);
    }
}

/// Covariance of a registered motion (x, y, rotation) from the deviation of its residuals; `centre` is the points' mean
/// as seen from the second pose.
#[must_use]
pub fn registered_covariance(found: &Registered, centre: &Point) -> Matrix3<f64> {
    let deviation = found.deviation.max(SMALLEST_DEVIATION);
    let variance = deviation * deviation / found.pairs as f64;
    let arm = found.pose.transform(centre) - found.pose.position();
    let by_rotation = Vector3::new(arm.y, -arm.x, 1.0);
    Matrix3::from_diagonal(&Vector3::new(variance, variance, 0.0))
        + by_rotation * by_rotation.transpose() * (variance / found.extent)
}

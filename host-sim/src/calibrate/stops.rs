//! The laser's motion from stop to stop (K 5.2).

use std::collections::BTreeMap;

use agv_core::calibration::{Registered, Registration};
use agv_core::geometry::{Point, difference};
use agv_core::measurement::Time;
use nalgebra::{Matrix3, Vector3};

use super::counted::Counted;
use super::reflector_noise::{MeanPoint, ReflectorNoise, weighted_motion};
use super::standstill::Standstill;
use super::tracking::TrackedRevolution;
use super::window::{Step, Window};
use super::windows::steps_between;

/// A standstill and what was seen from it.
#[derive(Clone, Debug, PartialEq)]
pub struct Stop {
    /// When.
    pub standstill: Standstill,
    /// Mean place of each reflector in S, by name.
    pub points: BTreeMap<usize, MeanPoint>,
}

/// A reflector counts at a stop if it was seen in this share of its revolutions.
const SMALLEST_SHARE: f64 = 0.3;
/// Sightings further than this from the median, m, are of something else.
const LARGEST_SCATTER: f64 = 0.06;

/// Averages what was seen at each standstill, and says how much single sightings scatter.
#[must_use]
pub fn stops(standstills: &[Standstill], revolutions: &[TrackedRevolution]) -> (Vec<Stop>, ReflectorNoise) {
    let mut scatter = Scatter::default();
    let stops = standstills.iter().map(|standstill| stop(standstill, revolutions, &mut scatter));
    let stops = stops.filter(|stop| stop.points.len() >= 2).collect();
    (stops, scatter.noise())
}

fn stop(standstill: &Standstill, revolutions: &[TrackedRevolution], scatter: &mut Scatter) -> Stop {
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
    let points = seen.into_iter().filter_map(|(name, points)| Some((name, mean(&points, scatter)?))).collect();
    Stop { standstill: *standstill, points }
}

/// Squared deviations of sightings from their means.
#[derive(Default)]
struct Scatter {
    range: f64,
    bearing: f64,
    freedom: usize,
}

/// What a laser of this kind has, where the stops are too short to say it: m, rad.
const USUAL_RANGE_DEVIATION: f64 = 0.01;
const USUAL_BEARING_DEVIATION: f64 = 1e-3;
/// Degrees of freedom that say it.
const FEWEST_SIGHTINGS: usize = 30;

impl Scatter {
    fn noise(&self) -> ReflectorNoise {
        if self.freedom < FEWEST_SIGHTINGS {
            return ReflectorNoise { range: USUAL_RANGE_DEVIATION, bearing: USUAL_BEARING_DEVIATION, lasting: 0.0 };
        }
        let deviation = |squares: f64| (squares / self.freedom as f64).sqrt();
        ReflectorNoise { range: deviation(self.range), bearing: deviation(self.bearing), lasting: 0.0 }
    }
}

/// Mean of the points near their median.
fn mean(points: &[Point], scatter: &mut Scatter) -> Option<MeanPoint> {
    let median = |coordinate: usize| {
        let mut values: Vec<f64> = points.iter().map(|point| point[coordinate]).collect();
        let middle = values.len() / 2;
        *values.select_nth_unstable_by(middle, f64::total_cmp).1
    };
    let median = Point::new(median(0), median(1));
    let near = || points.iter().filter(|point| (*point - median).norm() < LARGEST_SCATTER);
    let count = near().count();
    if count == 0 {
        return None;
    }
    let point = near().fold(Point::zeros(), |sum, point| sum + point) / count as f64;
    let (range, bearing) = (point.norm(), point.y.atan2(point.x));
    for seen in near() {
        scatter.range += (seen.norm() - range).powi(2);
        scatter.bearing += difference(seen.y.atan2(seen.x), bearing).powi(2);
    }
    scatter.freedom += count - 1;
    Some(MeanPoint { point, count })
}

/// The way between two stops.
#[derive(Clone, Debug)]
pub struct StopPair {
    /// Middle of the first standstill.
    pub start: Time,
    /// Middle of the second.
    pub end: Time,
    steps: Vec<Step>,
    pairs: Vec<(MeanPoint, MeanPoint)>,
    registered: Registered,
    /// Reflectors that have moved meanwhile.
    pub moved: usize,
}

/// Why a way between two stops gives no window.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoMotion {
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
const MOVED_DISTANCE: f64 = 0.012;
/// Share of the reflectors that may have moved.
const LARGEST_MOVED_SHARE: f64 = 0.34;
/// Larger differences between the places of reflectors, m, are no noise.
const LARGEST_DEVIATION: f64 = 0.02;
/// Share of the way against the sense of travel that is still taken as play.
const LARGEST_BACKLASH: f64 = 0.02;

/// The way from one stop to the next; fewer ticks than `shortest` are no way.
///
/// # Errors
/// [`NoMotion`].
pub fn between(counted: &[Counted], first: &Stop, second: &Stop, shortest: f64) -> Result<StopPair, NoMotion> {
    let (start, end) = (first.standstill.middle(), second.standstill.middle());
    let steps = steps_between(counted, start, end).finish();
    let way: f64 = steps.iter().map(|step| step.ticks).sum();
    let travelled: f64 = steps.iter().map(|step| step.ticks.abs()).sum();
    if travelled < shortest {
        return Err(NoMotion::Rest);
    }
    if travelled - way.abs() > 2.0 * LARGEST_BACKLASH * travelled {
        return Err(NoMotion::Reversal);
    }
    let mut pairs: Vec<(MeanPoint, MeanPoint)> =
        first.points.iter().filter_map(|(name, mean)| Some((*mean, *second.points.get(name)?))).collect();
    let allowed = (LARGEST_MOVED_SHARE * pairs.len() as f64) as usize;
    let mut moved = 0;
    loop {
        let mut registration = Registration::default();
        pairs.iter().for_each(|(first, second)| registration.add(&first.point, &second.point));
        let registered = registration.solve().filter(|found| found.pairs >= FEWEST_PAIRS);
        let registered = registered.ok_or(NoMotion::FewReflectors)?;
        let residual =
            |(first, second): &(MeanPoint, MeanPoint)| (registered.pose.transform(&second.point) - first.point).norm();
        let mut residuals: Vec<f64> = pairs.iter().map(residual).collect();
        let worst = (0..residuals.len()).max_by(|a, b| residuals[*a].total_cmp(&residuals[*b])).unwrap_or(0);
        let largest = residuals[worst];
        let middle = residuals.len() / 2;
        let typical = *residuals.select_nth_unstable_by(middle, f64::total_cmp).1;
        if largest > MOVED_DISTANCE && largest > MOVED_DEVIATIONS * typical && moved < allowed {
            pairs.remove(worst);
            moved += 1;
        } else if registered.deviation > LARGEST_DEVIATION {
            return Err(NoMotion::Disagreement);
        } else {
            return Ok(StopPair { start, end, steps, pairs, registered, moved });
        }
    }
}

/// The noise with that part of it which does not average: what the ways between stops leave over beyond the rest.
#[must_use]
pub fn with_lasting_part(ways: &[StopPair], noise: &ReflectorNoise) -> ReflectorNoise {
    let (mut excess, mut freedom) = (0.0, 0.0);
    for way in ways {
        if let Some(found) = weighted_motion(&way.pairs, &way.registered.pose, noise) {
            let pairs = way.pairs.len() as f64;
            // Three of the residuals' coordinates go into the motion.
            excess += found.squares[0] - found.squares[1] * (1.0 - 1.5 / pairs);
            freedom += 2.0 * (2.0 * pairs - 3.0);
        }
    }
    let variance = if freedom > 0.0 { (excess / freedom).max(0.0) } else { 0.0 };
    ReflectorNoise { lasting: variance.sqrt(), ..*noise }
}

impl StopPair {
    /// The window, with reflectors weighted by their noise.
    #[must_use]
    pub fn window(&self, noise: &ReflectorNoise) -> Option<Window> {
        let found = weighted_motion(&self.pairs, &self.registered.pose, noise)?;
        let mut window = Window {
            start: self.start,
            end: self.end,
            steps: self.steps.clone(),
            motion: found.motion,
            pose_errors: [Matrix3::zeros(); 2],
            shares_start: false,
        };
        window.set_covariance_parts(&found.parts)?;
        Some(window)
    }
}

/// Covariance of a pose (x, y, rotation), in S there, that is registered against points without error; `centre` is the
/// mean of the points in S.
#[must_use]
pub fn pose_error(found: &Registered, centre: &Point) -> Matrix3<f64> {
    let variance = found.deviation * found.deviation / found.pairs as f64;
    let by_rotation = Vector3::new(centre.y, -centre.x, 1.0);
    Matrix3::from_diagonal(&Vector3::new(variance, variance, 0.0))
        + by_rotation * by_rotation.transpose() * (variance / found.extent)
}

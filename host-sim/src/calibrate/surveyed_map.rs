//! Stops in a known map of reflectors.

use agv_core::calibration::Registration;
use agv_core::geometry::{Point, Pose};
use agv_core::maps::Landmark;
use agv_core::measurement::Time;
use nalgebra::Matrix3;

use super::stops::{Stop, pose_error};
use super::window::Window;

/// A stop that the map can place.
#[derive(Clone, Debug)]
pub struct PlacedStop {
    /// Middle of the standstill.
    pub time: Time,
    /// Pose of S in W.
    pub pose: Pose,
    /// Covariance of its error (x, y, rotation), in S there.
    pub error: Matrix3<f64>,
}

/// A reflector of the map and one that was seen belong together within this distance, m: first, and when the pose is known.
const WIDE_GATE: f64 = 0.3;
const NARROW_GATE: f64 = 0.1;
/// Two distances between reflectors are the same within this, m.
const SAME_LENGTH: f64 = 0.05;
/// Reflectors nearer together than this give no direction, m.
const SHORTEST_BASE: f64 = 2.0;
/// Pairs that place a stop, and the share of what was seen that must be in the map.
const FEWEST_PAIRS: usize = 4;
const SMALLEST_SHARE: f64 = 0.6;

/// Poses of S at the stops. The first stop that can be is placed without any prior, by trying all pairs of reflectors with
/// equal distances; the others follow by the motions between them.
#[must_use]
pub fn stop_poses(stops: &[Stop], windows: &[Window], map: &[Landmark]) -> Vec<PlacedStop> {
    let map: Vec<Point> = map.iter().map(|landmark| Point::new(landmark.x, landmark.y)).collect();
    let mut placed: Vec<PlacedStop> = Vec::new();
    for stop in stops {
        let time = stop.standstill.middle();
        let points: Vec<Point> = stop.points.values().map(|mean| mean.point).collect();
        let predicted = windows
            .iter()
            .find(|window| window.end == time)
            .and_then(|window| Some((placed.iter().find(|before| before.time == window.start)?, window)))
            .map(|(before, window)| before.pose.compose(&window.motion));
        let start = predicted.or_else(|| first_pose(&points, &map));
        let refined = start
            .and_then(|pose| place(&points, &map, &pose, WIDE_GATE))
            .and_then(|(pose, _)| place(&points, &map, &pose, NARROW_GATE));
        if let Some((pose, error)) = refined {
            placed.push(PlacedStop { time, pose, error });
        }
    }
    placed
}

fn nearest(map: &[Point], place: &Point) -> Option<(Point, f64)> {
    map.iter().map(|point| (*point, (point - place).norm())).min_by(|first, second| first.1.total_cmp(&second.1))
}

fn pairs(points: &[Point], map: &[Point], pose: &Pose, gate: f64) -> Vec<(Point, Point)> {
    points
        .iter()
        .filter_map(|point| Some((nearest(map, &pose.transform(point))?, *point)))
        .filter(|((_, distance), _)| *distance < gate)
        .map(|((place, _), point)| (place, point))
        .collect()
}

fn is_enough(pairs: usize, points: usize) -> bool {
    pairs >= FEWEST_PAIRS && pairs as f64 >= SMALLEST_SHARE * points as f64
}

fn place(points: &[Point], map: &[Point], pose: &Pose, gate: f64) -> Option<(Pose, Matrix3<f64>)> {
    let pairs = pairs(points, map, pose, gate);
    if !is_enough(pairs.len(), points.len()) {
        return None;
    }
    let mut registration = Registration::default();
    pairs.iter().for_each(|(place, point)| registration.add(place, point));
    let found = registration.solve()?;
    let centre = pairs.iter().fold(Point::zeros(), |sum, pair| sum + pair.1) / pairs.len() as f64;
    Some((found.pose, pose_error(&found, &centre)))
}

/// The pose with the most reflectors in the map, if it is clearly enough.
fn first_pose(points: &[Point], map: &[Point]) -> Option<Pose> {
    let mut best: Option<(usize, Pose)> = None;
    let base = |first: &Point, second: &Point| (second - first).norm();
    // From the first reflector to all others: any true pair leads to the pose.
    for (index, first) in points.iter().enumerate().take(2) {
        for second in points.iter().skip(index + 1).filter(|second| base(first, second) > SHORTEST_BASE) {
            for here in map {
                for there in map.iter().filter(|there| (base(here, there) - base(first, second)).abs() < SAME_LENGTH) {
                    let mut registration = Registration::default();
                    registration.add(here, first);
                    registration.add(there, second);
                    let Some(found) = registration.solve() else { continue };
                    let inliers = pairs(points, map, &found.pose, WIDE_GATE).len();
                    if best.is_none_or(|(most, _)| inliers > most) {
                        best = Some((inliers, found.pose));
                    }
                }
            }
        }
    }
    best.filter(|(inliers, _)| is_enough(*inliers, points.len())).map(|(_, pose)| pose)
}

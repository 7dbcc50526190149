//! Which reflector is which, from scan to scan (K 5.2).

use agv_core::calibration::Registration;
use agv_core::geometry::{Point, Pose};
use agv_core::maps::{NearestNeighbour, Verdict};
use agv_core::measurement::{ReflectorObservation, Time};

use super::odometry_path::OdometryPath;

/// A reflector of one revolution with its name.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sighting {
    /// Name of the reflector in this drive, counted from zero.
    pub reflector: usize,
    /// Where it is in S at the time of the beam, m.
    pub point: Point,
    /// When the beam crossed it.
    pub time: Time,
}

/// One revolution.
#[derive(Clone, Debug, PartialEq)]
pub struct TrackedRevolution {
    /// Time of the middle beam.
    pub time: Time,
    /// Pose of S at that time, in the frame in which the odometry began.
    pub pose: Pose,
    /// Whether the pose rests on enough reflectors.
    pub is_located: bool,
    /// The reflectors.
    pub sightings: Vec<Sighting>,
}

/// A reflector is looked for within this distance from where it should be, m: little less than the smallest distance
/// between reflectors in practice.
const GATE: f64 = 0.4;
/// The second best must be worse by this factor of the gate's square.
const MARGIN: f64 = 0.25;
/// Pairs that a registration needs.
const FEWEST_PAIRS: usize = 3;
/// A pair that is so far apart after registration, m, is none.
const LARGEST_RESIDUAL: f64 = 0.15;
/// Observations over which the place of a reflector is averaged.
const AVERAGED: f64 = 50.0;

struct Place {
    point: Point,
    seen: f64,
}

/// Follows the reflectors through all revolutions: each revolution is placed by odometry and by what the revolution before
/// has shown of the odometry's error, its reflectors are given the names of their nearest neighbours, and registration in
/// closed form takes away the error. Unknown ones get new names.
#[must_use]
pub fn track(revolutions: &[Vec<ReflectorObservation>], odometry: &OdometryPath) -> Vec<TrackedRevolution> {
    let mut places: Vec<Place> = Vec::new();
    // What takes points of odometry to the frame of the places.
    let mut correction = Pose::default();
    let mut tracked = Vec::with_capacity(revolutions.len());
    for revolution in revolutions {
        let Some(middle) = revolution.get(revolution.len() / 2) else { continue };
        let ends = [revolution.first(), revolution.last()]
            .map(|seen| odometry.robot_at(seen.map_or(middle.time, |seen| seen.time)));
        let standing = (ends[0] == ends[1]).then(|| odometry.laser_at(middle.time));
        let points: Vec<(Point, Point, Time)> = revolution
            .iter()
            .map(|seen| {
                let (sine, cosine) = f64::from(seen.bearing).sin_cos();
                let point = Point::new(cosine, sine) * f64::from(seen.range);
                let sensor = standing.unwrap_or_else(|| odometry.laser_at(seen.time));
                (point, sensor.transform(&point), seen.time)
            })
            .collect();
        let matched = names(&places, &points, &correction);
        let registered = register(&places, &points, &matched);
        if let Some(found) = registered {
            correction = found;
        }
        let mut sightings = Vec::with_capacity(points.len());
        for ((point, driven, time), name) in points.iter().zip(&matched) {
            let placed = correction.transform(driven);
            let reflector = match name {
                Match::Known(name) => *name,
                Match::Unclear => continue,
                Match::New => {
                    places.push(Place { point: placed, seen: 0.0 });
                    places.len() - 1
                }
            };
            let place = &mut places[reflector];
            if (placed - place.point).norm() < LARGEST_RESIDUAL && place.seen < AVERAGED {
                place.seen += 1.0;
                place.point += (placed - place.point) / place.seen;
            }
            sightings.push(Sighting { reflector, point: *point, time: *time });
        }
        let pose = correction.compose(&odometry.laser_at(middle.time));
        tracked.push(TrackedRevolution { time: middle.time, pose, is_located: registered.is_some(), sightings });
    }
    tracked
}

#[derive(Clone, Copy)]
enum Match {
    Known(usize),
    New,
    Unclear,
}

/// The name of each point; no name is given twice.
fn names(places: &[Place], points: &[(Point, Point, Time)], correction: &Pose) -> Vec<Match> {
    let mut taken = vec![false; places.len()];
    let name = |(_, driven, _): &(Point, Point, Time)| {
        let placed = correction.transform(driven);
        let mut nearest = NearestNeighbour::default();
        for (name, place) in places.iter().enumerate() {
            nearest.consider(name, (place.point - placed).norm_squared());
        }
        match nearest.decide(GATE * GATE, MARGIN * GATE * GATE) {
            (Some(best), Verdict::Accepted) if !std::mem::replace(&mut taken[best.landmark], true) => {
                Match::Known(best.landmark)
            }
            (_, Verdict::Unknown | Verdict::Gated) => Match::New,
            _ => Match::Unclear,
        }
    };
    points.iter().map(name).collect()
}

fn register(places: &[Place], points: &[(Point, Point, Time)], matched: &[Match]) -> Option<Pose> {
    let pairs: Vec<(Point, Point)> = points
        .iter()
        .zip(matched)
        .filter_map(|((_, driven, _), name)| match name {
            Match::Known(name) => Some((places[*name].point, *driven)),
            _ => None,
        })
        .collect();
    let solve = |pairs: &mut dyn Iterator<Item = &(Point, Point)>| {
        let mut registration = Registration::default();
        pairs.for_each(|(place, driven)| registration.add(place, driven));
        registration.solve().filter(|found| found.pairs >= FEWEST_PAIRS).map(|found| found.pose)
    };
    let first = solve(&mut pairs.iter())?;
    let agrees = |(place, driven): &&(Point, Point)| (first.transform(driven) - place).norm() < LARGEST_RESIDUAL;
    solve(&mut pairs.iter().filter(agrees))
}

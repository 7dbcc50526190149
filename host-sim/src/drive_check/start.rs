//! Whether the vehicle starts where it is said to.

use agv_core::geometry::{Point, Pose};
use agv_core::localizer::{AnyEvent, LandmarkUse};
use agv_core::maps::{Landmark, LandmarkKind};
use agv_core::measurement::{PoseFix, Time};

use super::Finding;
use crate::drive::KINDS;
use crate::recording::Recording;
use crate::replay::{Replay, find_start};

/// What is seen in so many seconds after the start is laid onto the map: the odometry does not drift in them.
const FIRST: f64 = 6.0;
/// Sightings that tell a place.
const FEWEST: usize = 40;
/// Sightings that are looked at, at the most.
const MOST: usize = 200;
/// A sighting fits if a landmark of its kind is so near, m.
const NEAR: f64 = 0.2;
/// Places that are tried: shifts to each side, m, their spacing, and turns, rad.
const FARTHEST: f64 = 6.0;
const SPACING: f64 = 0.2;
const TURNS: i32 = 6;
const TURN: f64 = 2.0 * std::f64::consts::PI / 180.0;
/// Share of the sightings that must fit elsewhere, and by how much more than where the vehicle is said to be.
const FITTING: f64 = 0.7;
const BETTER: f64 = 1.6;
/// A vehicle that finds itself later, s, may have been carried meanwhile.
const LATEST: f64 = 20.0;
/// A start that is nearer is no mistake, m.
const HARMLESS: f64 = 0.5;

/// Where the landmarks that are seen first have the vehicle, if that is elsewhere than it is said to be.
pub(super) fn finding(recording: &Recording, replay: &Replay, log: &str) -> Option<Finding> {
    let fix: &PoseFix =
        recording.events.iter().find_map(|event| if let AnyEvent::SetPose(fix) = event { Some(fix) } else { None })?;
    let seen = first_sightings(replay, fix.time);
    if seen.len() < FEWEST {
        return None;
    }
    let map = Map::of(&recording.landmarks)?;
    let count = |moved: &Pose| seen.iter().filter(|(kind, place)| map.is_near(*kind, &moved.transform(place))).count();
    // Turns are about where the vehicle is.
    let about = |x: f64, y: f64, turn: f64| {
        let centre = fix.pose.position();
        let turned = Pose::new(0.0, 0.0, turn).transform(&centre);
        Pose::new(centre.x - turned.x + x, centre.y - turned.y + y, turn)
    };
    let here = count(&Pose::default());
    let steps = (FARTHEST / SPACING) as i32;
    let shifts = || (-steps..=steps).map(|step| f64::from(step) * SPACING);
    let mut best = (0, Pose::default());
    for turn in (-TURNS..=TURNS).map(|step| f64::from(step) * TURN) {
        for x in shifts() {
            for y in shifts() {
                let moved = about(x, y, turn);
                let found = count(&moved);
                if found > best.0 {
                    best = (found, moved);
                }
            }
        }
    }
    let start = best.1.compose(&fix.pose);
    let off = (start.position() - fix.pose.position()).norm();
    let is_clear = best.0 as f64 > FITTING * seen.len() as f64 && best.0 as f64 > BETTER * here as f64;
    (is_clear && off > HARMLESS).then(|| {
        let [x, y, heading] = [start.x, start.y, start.theta.to_degrees()];
        Finding::new(
            format!("the start pose is off by {off:.1} m: what is seen first fits the map from {x:.2}, {y:.2}, {heading:.0} deg"),
            format!("agv replay {log} --start {x:.2},{y:.2},{heading:.1}"),
        )
    })
}

/// Where the reflectors that are seen first have a vehicle that is lost, if that is elsewhere than the pose that it was told has it.
pub(super) fn finding_by_reflectors(recording: &Recording, replay: &Replay, log: &str) -> Option<Finding> {
    let told = recording.events.iter().position(|event| matches!(event, AnyEvent::SetPose(_)))?;
    let AnyEvent::SetPose(fix) = recording.events.get(told)? else { return None };
    let (found_at, found) = find_start(recording).ok().filter(|(number, _)| *number > told)?;
    // A pose that is lost is carried on by the odometry.
    let [from, to] = [told, found_at].map(|event| replay.poses.get(event).map(|output| output.pose));
    let way = from?.between(&to?);
    let start = found.pose.compose(&way.inverse());
    let off = (start.position() - fix.pose.position()).norm();
    (off > HARMLESS && found.time.since(fix.time) < LATEST).then(|| {
        let [x, y, heading] = [start.x, start.y, start.theta.to_degrees()];
        Finding::new(
            format!("the start pose is off by {off:.1} m: the reflectors that are seen first have the vehicle at {x:.2}, {y:.2}, {heading:.0} deg"),
            format!("agv replay {log} --relocalise reflectors"),
        )
    })
}

/// What was seen first, where the believed pose had it.
fn first_sightings(replay: &Replay, start: Time) -> Vec<(LandmarkKind, Point)> {
    let is_first = |used: &&LandmarkUse| (0.0..FIRST).contains(&used.time.since(start));
    let place = |used: &LandmarkUse| (used.kind, Point::new(used.located[0], used.located[1]));
    let all: Vec<_> = replay
        .uses
        .iter()
        .filter(is_first)
        .map(place)
        .filter(|(_, place)| place.x.is_finite() && place.y.is_finite())
        .collect();
    let stride = all.len().div_ceil(MOST).max(1);
    all.into_iter().step_by(stride).collect()
}

/// The cells of the floor, one plan a kind of landmark, near which a landmark is.
struct Map {
    low: Point,
    columns: usize,
    rows: usize,
    plans: Vec<Vec<bool>>,
}

/// Size of a cell, m; cells of one plan at the most: a map that is wider is not looked at.
const CELL: f64 = 0.1;
const MOST_CELLS: usize = 1 << 24;

impl Map {
    fn of(landmarks: &[Landmark]) -> Option<Self> {
        let places = || landmarks.iter().map(Landmark::position);
        let low = places().fold(Point::repeat(f64::INFINITY), |low, place| low.inf(&place)) - Point::repeat(1.0);
        let high = places().fold(Point::repeat(f64::NEG_INFINITY), |high, place| high.sup(&place)) + Point::repeat(1.0);
        let cells = |axis: usize| ((high[axis] - low[axis]) / CELL).ceil().clamp(0.0, MOST_CELLS as f64) as usize + 1;
        let (columns, rows) = (cells(0), cells(1));
        if landmarks.is_empty() || columns.saturating_mul(rows) > MOST_CELLS {
            return None;
        }
        let mut map = Self { low, columns, rows, plans: vec![vec![false; columns * rows]; KINDS.len()] };
        let reach = (NEAR / CELL) as i32;
        for landmark in landmarks {
            let Some(plan) = KINDS.iter().position(|kind| *kind == landmark.kind) else { continue };
            for (dx, dy) in (-reach..=reach).flat_map(|dx| (-reach..=reach).map(move |dy| (dx, dy))) {
                let beside = landmark.position() + Point::new(f64::from(dx) * CELL, f64::from(dy) * CELL);
                if dx * dx + dy * dy <= reach * reach
                    && let Some(cell) = map.cell(&beside)
                {
                    map.plans[plan][cell] = true;
                }
            }
        }
        Some(map)
    }

    fn cell(&self, place: &Point) -> Option<usize> {
        let (column, row) = ((place.x - self.low.x) / CELL, (place.y - self.low.y) / CELL);
        let is_inside = column >= 0.0 && row >= 0.0 && column < self.columns as f64 && row < self.rows as f64;
        is_inside.then(|| row as usize * self.columns + column as usize)
    }

    fn is_near(&self, kind: LandmarkKind, place: &Point) -> bool {
        let plan = KINDS.iter().position(|known| *known == kind);
        plan.zip(self.cell(place)).is_some_and(|(plan, cell)| self.plans[plan][cell])
    }
}

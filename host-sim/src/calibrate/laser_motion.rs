//! How a laser has moved, by what it sees alone: nothing of the vehicle is believed.
//!
//! Each revolution is laid onto those before it, from where the velocity of the step before leads it; the motion within the revolution is
//! taken out by that velocity.

use agv_core::calibration::Registration;
use agv_core::contours::{ContourMatcher, Prediction};
use agv_core::geometry::{Point, Pose, Twist};
use agv_core::measurement::{LaserId, ReflectorObservation, Time};
use agv_core::sensing::{PointScan, SensorPath};

use super::windows::LaserPose;
use crate::recording::{RecordedEvent, RecordedScan, Recording};

/// Beams of a scan and points of its surfaces that are looked at.
const BEAMS: usize = 720;
const POINTS: usize = 400;
/// Ranges that are used, m.
const RANGES: (f32, f32) = (0.5, 60.0);
/// A longer time between two revolutions tears the motion, s.
const LONGEST_STEP: f64 = 0.6;
/// What may change from one revolution to the next, m and rad: 1 m/s^2 and 1 rad/s^2 in an eighth of a second, and what is not seen.
const CHANGE: (f64, f64) = (0.05, 0.06);
/// Points that must lie on surfaces seen before.
const LEAST_SHARE: f32 = 0.5;
/// Rounds in which a revolution is laid onto the others: with the velocity of the step before, then with its own.
const ROUNDS: usize = 2;
/// Places along the way during a revolution.
const PATH_STEPS: u32 = 4;
/// Reflectors that a step needs, and how near they must be to where they were, m.
const FEWEST: usize = 3;
const GATE: f64 = 0.4;
const RESIDUAL: f64 = 0.12;
/// Turns from where it is expected in which a revolution of reflectors is looked for, rad.
const TURNS: [f64; 7] = [0.0, 0.04, -0.04, 0.08, -0.08, 0.12, -0.12];
/// Shortest motion that is worth something, s.
const SHORTEST: f64 = 10.0;

/// Poses of the first laser in a frame of its own, over the longest time in which it could be followed without a gap: by reflectors if
/// enough are seen at once, else by scans. Empty if there is none.
#[must_use]
pub fn laser_motion(recording: &Recording) -> Vec<LaserPose> {
    let by_reflectors = reflector_motion(recording.events.iter().filter_map(|event| match event {
        RecordedEvent::Reflectors(seen) if seen.laser == LaserId::FIRST => Some(&seen.observations[..]),
        _ => None,
    }));
    let scans = || {
        recording.events.iter().filter_map(|event| match event {
            RecordedEvent::Scan(scan) if scan.laser == LaserId::FIRST => Some(scan),
            _ => None,
        })
    };
    let last = |poses: &[LaserPose]| poses.first().zip(poses.last()).map_or(0.0, |(a, b)| b.time.since(a.time));
    let has_scans = scans().nth(FEWEST_SCANS).is_some();
    let all = recording.events.iter().filter_map(RecordedEvent::time);
    let duration = all.clone().max().zip(all.min()).map_or(0.0, |(end, begin)| end.since(begin));
    // Reflectors that are seen most of the time are more exact.
    if last(&by_reflectors) >= 0.5 * duration || !has_scans { by_reflectors } else { scan_motion(scans()) }
}

/// Scans that make a motion.
const FEWEST_SCANS: usize = 20;

/// The motion so far.
struct Followed {
    /// Poses without a gap, one list each time that they were torn.
    pieces: Vec<Vec<LaserPose>>,
    /// For each second.
    velocity: Twist,
}

impl Followed {
    const fn new() -> Self {
        Self { pieces: Vec::new(), velocity: Twist { x: 0.0, y: 0.0, theta: 0.0 } }
    }

    fn last(&self) -> Option<&LaserPose> {
        self.pieces.last()?.last()
    }

    fn tear(&mut self) {
        self.velocity = Twist { x: 0.0, y: 0.0, theta: 0.0 };
        self.pieces.push(Vec::new());
    }

    /// Where the velocity leads, and after which time; none if nothing leads there.
    fn ahead(&self, time: Time) -> Option<(Pose, f64)> {
        let last = self.last()?;
        let step = time.since(last.time);
        (step > 0.0 && step < LONGEST_STEP).then(|| (last.pose.compose(&after(&self.velocity, step)), step))
    }

    fn add(&mut self, time: Time, pose: Pose) {
        if self.pieces.is_empty() {
            self.pieces.push(Vec::new());
        }
        if let Some(piece) = self.pieces.last_mut() {
            piece.push(LaserPose { time, pose });
        }
    }

    fn longest(self) -> Vec<LaserPose> {
        let duration =
            |piece: &Vec<LaserPose>| piece.first().zip(piece.last()).map_or(0.0, |(a, b)| b.time.since(a.time));
        let longest = self.pieces.into_iter().max_by(|a, b| duration(a).total_cmp(&duration(b)));
        longest.filter(|piece| duration(piece) >= SHORTEST).unwrap_or_default()
    }
}

fn after(velocity: &Twist, time: f64) -> Pose {
    Pose::exp(&Twist { x: velocity.x * time, y: velocity.y * time, theta: velocity.theta * time })
}

fn velocity(from: &Pose, to: &Pose, time: f64) -> Twist {
    let moved = from.between(to).log();
    Twist { x: moved.x / time, y: moved.y / time, theta: moved.theta / time }
}

/// The same by scans; the pose of each is that at its first beam.
pub fn scan_motion<'a>(scans: impl Iterator<Item = &'a RecordedScan>) -> Vec<LaserPose> {
    let mut matcher = Box::new(ContourMatcher::<POINTS, 20, 4096>::new());
    let mut points = PointScan::<BEAMS>::new();
    let mut followed = Followed::new();
    for scan in scans {
        let mut see = |velocity: &Twist, matcher: &mut ContourMatcher<POINTS, 20, 4096>| {
            let view = scan.view();
            points.set(&view, RANGES.0, RANGES.1);
            let duration = view.end().since(scan.start);
            let time = |step: u32| duration * f64::from(step) / f64::from(PATH_STEPS);
            let ways = (0..=PATH_STEPS).map(|step| (scan.start.offset(time(step)), after(velocity, time(step))));
            let mut path = SensorPath::default();
            path.set(scan.start, &Pose::default(), ways);
            path.correct(&view, &mut points);
            matcher.see(points.view());
        };
        let Some((mut predicted, step)) = followed.ahead(scan.start) else {
            followed.tear();
            matcher.clear();
            see(&followed.velocity, &mut matcher);
            matcher.keep(&Pose::default());
            followed.add(scan.start, Pose::default());
            continue;
        };
        let before = followed.last().map_or(predicted, |last| last.pose);
        let mut speed = followed.velocity;
        let mut found = None;
        for _ in 0..ROUNDS {
            see(&speed, &mut matcher);
            let prediction = Prediction { pose: predicted, position_deviation: CHANGE.0, heading_deviation: CHANGE.1 };
            found = matcher.align(&prediction).filter(|found| found.share >= LEAST_SHARE && found.free_axis.is_none());
            let Some(found) = &found else { break };
            predicted = found.pose;
            speed = velocity(&before, &found.pose, step);
        }
        match found {
            Some(found) => {
                followed.velocity = speed;
                matcher.keep(&found.pose);
                followed.add(scan.start, found.pose);
            }
            None => followed.tear(),
        }
    }
    followed.longest()
}

/// The same by reflectors; the pose of each revolution is that at its middle reflector.
pub fn reflector_motion<'a>(revolutions: impl Iterator<Item = &'a [ReflectorObservation]>) -> Vec<LaserPose> {
    let mut followed = Followed::new();
    let mut places: Vec<(Point, f64)> = Vec::new();
    for seen in revolutions {
        let Some(middle) = seen.get(seen.len() / 2).filter(|_| seen.len() >= FEWEST) else { continue };
        let Some((predicted, step)) = followed.ahead(middle.time) else {
            followed.tear();
            places = in_laser(seen, middle.time, &followed.velocity).into_iter().map(|point| (point, 1.0)).collect();
            followed.add(middle.time, Pose::default());
            continue;
        };
        let before = followed.last().map_or(predicted, |last| last.pose);
        let mut speed = followed.velocity;
        let mut pose = None;
        for _ in 0..ROUNDS {
            let points = in_laser(seen, middle.time, &speed);
            let from = pose.unwrap_or(predicted);
            pose = TURNS.iter().find_map(|turn| register(&places, &points, &from.compose(&Pose::new(0.0, 0.0, *turn))));
            let Some(found) = pose else { break };
            speed = velocity(&before, &found, step);
        }
        let Some(found) = pose else {
            followed.tear();
            continue;
        };
        followed.velocity = speed;
        followed.add(middle.time, found);
        for point in in_laser(seen, middle.time, &speed) {
            let place = found.transform(&point);
            match places.iter_mut().find(|(known, _)| (*known - place).norm() < GATE) {
                Some((known, count)) if *count < AVERAGED => {
                    *count += 1.0;
                    *known += (place - *known) / *count;
                }
                Some(_) => {}
                None => places.push((place, 1.0)),
            }
        }
    }
    followed.longest()
}

/// Observations over which the place of a reflector is averaged.
const AVERAGED: f64 = 50.0;

/// Reflectors in the frame of the laser at a time.
fn in_laser(seen: &[ReflectorObservation], time: Time, velocity: &Twist) -> Vec<Point> {
    let place = |one: &ReflectorObservation| {
        let (sine, cosine) = f64::from(one.bearing).sin_cos();
        let range = f64::from(one.range);
        after(velocity, one.time.since(time)).transform(&Point::new(range * cosine, range * sine))
    };
    let is_good = |one: &&ReflectorObservation| one.range.is_finite() && one.bearing.is_finite() && one.range > 0.0;
    seen.iter().filter(is_good).map(place).collect()
}

/// The pose near the expected one from which most of the reflectors are where they were; none if too few are.
fn register(places: &[(Point, f64)], points: &[Point], expected: &Pose) -> Option<Pose> {
    let mut pose = *expected;
    let mut reach = GATE;
    for _ in 0..3 {
        let mut registration = Registration::default();
        let mut pairs = 0;
        for point in points {
            let here = pose.transform(point);
            let nearest =
                places.iter().map(|(place, _)| place).min_by(|a, b| (*a - here).norm().total_cmp(&(*b - here).norm()));
            if let Some(place) = nearest.filter(|place| (*place - here).norm() < reach) {
                registration.add(place, point);
                pairs += 1;
            }
        }
        if pairs < FEWEST.max(points.len().div_ceil(2)) {
            return None;
        }
        pose = registration.solve()?.pose;
        reach = RESIDUAL;
    }
    Some(pose)
}

//! A map from a drive through an unknown hall: key scans in a graph of odometry, aligned neighbours and closed loops.

use std::time::Instant;

use agv_core::geometry::{Point, Pose};
use agv_core::measurement::Time;
use agv_places::{
    Candidate, GlareParameters, GlareTables, OverlapParameters, PlaceIndex, Recognition, RecognitionParameters,
    Recognizer, ScanAlignmentParameters, align_scans, overlap,
};
use nalgebra::Matrix3;

use super::pose_graph::{Edge, PoseGraphError, optimise};
use crate::places::{Observation, Observer, SURE_CONFIDENCE};
use crate::recording::RecordedScan;

/// How a map is made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlamParameters {
    /// A scan is a key scan if the vehicle has moved this far since the last one, m.
    pub key_shift: f64,
    /// The same for its heading, rad.
    pub key_turn: f64,
    /// Key scans between the ends of a loop, at least.
    pub loop_scans: usize,
    /// Time between the ends of a loop, at least, s.
    pub loop_seconds: f64,
    /// Loops are believed from this confidence on.
    pub least_confidence: f32,
    /// Keypoints that support a loop, at least.
    pub least_points: usize,
    /// Loops that differ from the solved graph by more than this are taken out, m and rad.
    pub largest_disagreement: (f64, f64),
}

impl SlamParameters {
    /// Loops between scans that are well apart in time.
    #[must_use]
    pub const fn honest() -> Self {
        Self {
            key_shift: 0.3,
            key_turn: 0.25,
            loop_scans: 50,
            loop_seconds: 10.0,
            least_confidence: SURE_CONFIDENCE,
            least_points: 5,
            largest_disagreement: (0.3, 0.06),
        }
    }

    /// Loops between all scans that are no neighbours.
    #[must_use]
    pub const fn all() -> Self {
        Self { loop_scans: 2, loop_seconds: 0.0, ..Self::honest() }
    }
}

/// A key scan.
#[derive(Clone, Debug)]
pub struct KeyScan {
    /// Number of the scan.
    pub scan: usize,
    /// When it was taken.
    pub time: Time,
    /// What is seen in it.
    pub observation: Observation,
    /// Pose of S by odometry alone.
    pub odometry: Pose,
}

/// A map.
#[derive(Clone, Debug)]
pub struct SlamMap {
    /// Key scans in order of time.
    pub keys: Vec<KeyScan>,
    /// Pose of S at each key scan; the first one is where odometry says.
    pub poses: Vec<Pose>,
    /// Loops that were found and kept.
    pub closures: Vec<Edge>,
    /// Loops that were found, and did not agree with the rest.
    pub refused: Vec<Edge>,
    /// Processor time of the whole, s.
    pub elapsed: f64,
}

impl SlamMap {
    /// The points of all key scans in the frame of the map, m.
    #[must_use]
    pub fn points(&self) -> Vec<Point> {
        let of_key = |(key, pose): (&KeyScan, &Pose)| {
            let present = key
                .observation
                .points
                .points
                .iter()
                .zip(&key.observation.points.ranges)
                .filter(|(_, range)| **range > 0.0);
            present.map(|(point, _)| pose.transform(&point.cast())).collect::<Vec<_>>()
        };
        self.keys.iter().zip(&self.poses).flat_map(of_key).collect()
    }
}

/// Most key scans of a map.
const KEYS: usize = 8192;
/// Places that are looked at for each key scan.
const CANDIDATES: usize = 10;
/// Deviation of odometry: share of the way, and of the turn, and the least (m, rad).
const ODOMETRY: (f64, f64, f64, f64) = (0.1, 0.2, 0.05, 0.1);
/// Points of one surface err together: the information that they give is smaller by this factor.
const INFLATION: f64 = 5.0;
/// No alignment is better than this, m and rad.
const FLOOR: (f64, f64) = (0.005, 0.003);
/// Neighbours in space within this distance (m) and turn (rad) of each other are aligned once the graph is solved.
const NEAR: (f64, f64) = (2.0, 0.8);
/// Neighbours that are tried for each key scan.
const NEIGHBOURS: usize = 4;
/// Rounds of solving and taking out loops.
const ROUNDS: usize = 3;

/// Makes a map of scans, given with the pose of S by odometry.
///
/// # Errors
/// If the graph cannot be solved.
pub fn map(
    scans: &[(&RecordedScan, Pose)],
    parameters: &SlamParameters,
    done: impl Fn(),
) -> Result<SlamMap, PoseGraphError> {
    let start = Instant::now();
    let keys = key_scans(scans, parameters);
    let (mut poses, sequence) = chain(&keys);
    let mut loops = close_loops(&keys, parameters, &done);
    poses = optimise(&poses, &[sequence.as_slice(), &loops].concat())?;
    let mut refused = take_out(&mut loops, &poses, parameters);
    for _ in 0..ROUNDS {
        poses = optimise(&poses, &[sequence.as_slice(), &loops].concat())?;
        let near = align_neighbours(&keys, &poses, &loops, parameters);
        loops.extend(near);
        poses = optimise(&poses, &[sequence.as_slice(), &loops].concat())?;
        refused.extend(take_out(&mut loops, &poses, parameters));
    }
    poses = optimise(&poses, &[sequence.as_slice(), &loops].concat())?;
    refused.extend(take_out(&mut loops, &poses, parameters));
    Ok(SlamMap { keys, poses, closures: loops, refused, elapsed: start.elapsed().as_secs_f64() })
}

fn key_scans(scans: &[(&RecordedScan, Pose)], parameters: &SlamParameters) -> Vec<KeyScan> {
    let mut observer = Observer::default();
    let mut keys: Vec<KeyScan> = Vec::new();
    for (number, (scan, odometry)) in scans.iter().enumerate() {
        let is_key = keys.last().is_none_or(|last| {
            let moved = last.odometry.between(odometry);
            moved.position().norm() > parameters.key_shift || moved.theta.abs() > parameters.key_turn
        });
        if !is_key || keys.len() == KEYS {
            continue;
        }
        let observation = observer.observe(scan);
        keys.push(KeyScan { scan: number, time: scan.start, observation, odometry: *odometry });
    }
    keys
}

/// Aligns each key scan with the one before.
fn chain(keys: &[KeyScan]) -> (Vec<Pose>, Vec<Edge>) {
    let mut poses: Vec<Pose> = keys.first().map(|key| key.odometry).into_iter().collect();
    let mut edges = Vec::new();
    for (from, pair) in keys.windows(2).enumerate() {
        let [before, after] = pair else { continue };
        let moved = before.odometry.between(&after.odometry);
        let aligned = best_alignment(after, before, &moved);
        let displacement = aligned.map_or(moved, |found| found.pose);
        let to = from + 1;
        edges.extend(aligned.map(|found| edge(from, to, &found, false)));
        // Odometry fixes what a corridor leaves open; where the scans contradict it, it is not asked.
        let departure = moved.between(&displacement);
        let (shift, turn) = (moved.position().norm(), moved.theta.abs());
        let deviations = (ODOMETRY.0 * shift + ODOMETRY.2, ODOMETRY.1 * turn + ODOMETRY.3);
        if departure.position().norm() < CONTRADICTION * deviations.0
            && departure.theta.abs() < CONTRADICTION * deviations.1
        {
            let information = information_of(deviations);
            edges.push(Edge { from, to, displacement: moved, information, is_doubtful: false });
        }
        let last = poses[from];
        poses.push(last.compose(&displacement));
    }
    (poses, edges)
}

/// The alignment of two neighbouring key scans that agrees best with both, started from the odometry and, where that
/// fails, beside it: wheels slip, and some odometry loses the sign of the way when the vehicle reverses.
fn best_alignment(source: &KeyScan, target: &KeyScan, moved: &Pose) -> Option<Recognition> {
    let try_from = |start: &Pose| {
        let found = aligned(source, target, start).filter(|found| found.confidence() > LEAST_SEQUENCE_CONFIDENCE)?;
        // In a corridor all displacements along it look alike: what departs from the odometry must look better.
        let departure = moved.between(&found.pose);
        let doubt = DEPARTURE.0 * departure.position().norm() + DEPARTURE.1 * departure.theta.abs();
        Some((f64::from(found.confidence()) - doubt, found))
    };
    let mut best = try_from(moved);
    let merit = |found: &Option<(f64, Recognition)>| found.as_ref().map_or(f64::NEG_INFINITY, |(merit, _)| *merit);
    if merit(&best) < SURE_SEQUENCE_CONFIDENCE {
        for sign in [1.0, 0.0, -1.0] {
            for turn in TURNS {
                let found = try_from(&Pose::new(sign * moved.x, sign * moved.y, moved.theta + turn));
                if merit(&found) > merit(&best) {
                    best = found;
                }
            }
        }
    }
    best.map(|(_, found)| found)
}

/// By how much confidence must rise for each metre, and each radian, that an alignment departs from the odometry.
const DEPARTURE: (f64, f64) = (0.2, 0.2);
/// Odometry that is wrong by more than so many standard deviations is left out.
const CONTRADICTION: f64 = 3.0;
/// Least confidence of an alignment of neighbouring key scans.
const LEAST_SEQUENCE_CONFIDENCE: f32 = 0.45;
/// An alignment of this confidence needs no other start.
const SURE_SEQUENCE_CONFIDENCE: f64 = 0.8;
/// Errors of the odometry's turn from which an alignment is started, rad.
const TURNS: [f64; 7] = [0.0, 0.1, -0.1, 0.2, -0.2, 0.35, -0.35];

fn information_of((shift, turn): (f64, f64)) -> Matrix3<f64> {
    Matrix3::from_diagonal(&nalgebra::Vector3::new(1.0 / (shift * shift), 1.0 / (shift * shift), 1.0 / (turn * turn)))
}

/// What an alignment says of two key scans.
fn edge(from: usize, to: usize, found: &Recognition, is_doubtful: bool) -> Edge {
    let (sine, cosine) = found.pose.theta.sin_cos();
    let turn = Matrix3::new(cosine, -sine, 0.0, sine, cosine, 0.0, 0.0, 0.0, 1.0);
    let information = turn.transpose() * (found.information / INFLATION) * turn;
    // A floor under the covariance, and one under the information where a corridor fixes nothing.
    let floor =
        Matrix3::from_diagonal(&nalgebra::Vector3::new(FLOOR.0 * FLOOR.0, FLOOR.0 * FLOOR.0, FLOOR.1 * FLOOR.1));
    let least = information_of((10.0, 1.0));
    let covariance = (information + least).try_inverse().unwrap_or_else(Matrix3::identity) + floor;
    let information = covariance.try_inverse().unwrap_or(least);
    let information = 0.5 * (information + information.transpose());
    Edge { from, to, displacement: found.pose, information, is_doubtful }
}

/// Aligns two key scans from a first guess of the pose of the source in the frame of the target.
fn aligned(source: &KeyScan, target: &KeyScan, start: &Pose) -> Option<Recognition> {
    let parameters =
        ScanAlignmentParameters { first_reach: 0.4, last_reach: 0.08, iterations: 12, every: 1, ..Default::default() };
    let found = align_scans(&source.observation.points, &target.observation.points, start, &parameters)?;
    let overlap = overlap(
        &source.observation.points,
        &target.observation.points,
        &found.pose,
        &OverlapParameters { near: 0.07, ..Default::default() },
    );
    Some(Recognition { pose: found.pose, information: found.information, points: 0, overlap })
}

fn is_loop(keys: &[KeyScan], earlier: usize, later: usize, parameters: &SlamParameters) -> bool {
    earlier + parameters.loop_scans < later && keys[later].time.since(keys[earlier].time) > parameters.loop_seconds
}

/// Recognises each key scan among the earlier ones.
fn close_loops(keys: &[KeyScan], parameters: &SlamParameters, done: &impl Fn()) -> Vec<Edge> {
    let tables = GlareTables::new(&GlareParameters::default());
    let mut index = Box::new(PlaceIndex::<KEYS>::new());
    let mut recognizer = Box::<Recognizer<1024, 32>>::default();
    let mut loops = Vec::new();
    for (number, key) in keys.iter().enumerate() {
        let signature = key.observation.signature(&tables);
        let mut candidates = heapless::Vec::<Candidate, CANDIDATES>::new();
        let is_admissible = |place: u32| is_loop(keys, place as usize, number, parameters);
        index.search(&signature, is_admissible, &mut candidates);
        let query = key.observation.view();
        let best = candidates
            .iter()
            .filter_map(|candidate| {
                let place = keys[candidate.place as usize].observation.view();
                let found = recognizer.recognise(&query, &place, &RecognitionParameters::default())?;
                Some((candidate.place as usize, found))
            })
            .max_by(|a, b| a.1.confidence().total_cmp(&b.1.confidence()));
        if let Some((place, found)) = best
            && found.confidence() >= parameters.least_confidence
            && found.points >= parameters.least_points
            && found.information.trace() > 0.0
        {
            loops.push(edge(place, number, &found, true));
        }
        // There is room: key scans are no more than places.
        let _ = index.push(signature);
        done();
    }
    loops
}

/// Aligns key scans that the solved graph puts next to each other.
fn align_neighbours(keys: &[KeyScan], poses: &[Pose], known: &[Edge], parameters: &SlamParameters) -> Vec<Edge> {
    let mut found = Vec::new();
    for later in 0..keys.len() {
        let mut near: Vec<(f64, usize)> = (0..later)
            .filter(|&earlier| is_loop(keys, earlier, later, parameters))
            .filter_map(|earlier| {
                let apart = poses[earlier].between(&poses[later]);
                let distance = apart.position().norm();
                (distance < NEAR.0 && apart.theta.abs() < NEAR.1).then_some((distance, earlier))
            })
            .collect();
        near.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (_, earlier) in near.into_iter().take(NEIGHBOURS) {
            if known.iter().any(|edge| edge.from == earlier && edge.to == later) {
                continue;
            }
            let start = poses[earlier].between(&poses[later]);
            if let Some(alignment) = aligned(&keys[later], &keys[earlier], &start)
                && alignment.confidence() >= parameters.least_confidence
            {
                found.push(edge(earlier, later, &alignment, true));
            }
        }
    }
    found
}

/// Takes out the loops that disagree with the poses, and returns them.
fn take_out(loops: &mut Vec<Edge>, poses: &[Pose], parameters: &SlamParameters) -> Vec<Edge> {
    let (shift, turn) = parameters.largest_disagreement;
    let agrees = |edge: &Edge| {
        let error = edge.error(poses);
        error.position().norm() <= shift && error.theta.abs() <= turn
    };
    let refused = loops.iter().filter(|edge| !agrees(edge)).copied().collect();
    loops.retain(agrees);
    refused
}

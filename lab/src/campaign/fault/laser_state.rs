//! What faults of the laser remember of a drive: who walks about, which reflectors have gone, how far an error has wandered.

use std::collections::BTreeSet;

use agv_core::geometry::{Point, Pose};
use agv_core::maps::Landmark;
use agv_core::measurement::{ReflectorObservation, Time};

use super::{FaultKind, RangeError, ViewError};
use agv_host_sim::recording::{Recording, Truth, truth_at};
use agv_host_sim::simulate::random::Random;

/// What is seen this near to a reflector, m, is that reflector.
const SAME: f64 = 0.5;

/// Shares of the reflectors that have another shape than is set, and that are half hidden.
const OTHER_SHAPE: f64 = 0.5;
const HALF_HIDDEN: f64 = 1.0 / 3.0;

/// What a fault of the laser remembers.
pub(super) struct LaserState {
    truth: Vec<Truth>,
    mount: Pose,
    landmarks: Vec<Landmark>,
    /// Those that the fault is about.
    chosen: BTreeSet<u16>,
    /// What the revolution before has shown, bearings and distances.
    shown: Vec<(f32, f32)>,
    walkers: Walkers,
    wander: f64,
    wandered_at: Option<f64>,
}

impl LaserState {
    pub(super) fn new(what: FaultKind, recording: &Recording, random: &mut Random) -> Self {
        let walkers = Walkers::new(what, random);
        let chosen = match what {
            FaultKind::ReflectorsGone { share } => Some(share),
            FaultKind::RangesOff { how: RangeError::OtherShape, .. } => Some(OTHER_SHAPE),
            FaultKind::ViewOff { how: ViewError::HalfHidden, .. } => Some(HALF_HIDDEN),
            _ => None,
        };
        let chosen = chosen.map_or_else(BTreeSet::new, |share| {
            recording.landmarks.iter().filter(|_| random.happens(share)).map(|landmark| landmark.id).collect()
        });
        Self {
            truth: recording.truth.clone(),
            mount: *recording.parameters.lasers.first(),
            landmarks: recording.landmarks.clone(),
            chosen,
            shown: Vec::new(),
            walkers,
            wander: 0.0,
            wandered_at: None,
        }
    }

    /// Pose of S in W.
    pub(super) fn sensor(&self, time: Time) -> Option<Pose> {
        Some(truth_at(&self.truth, time)?.compose(&self.mount))
    }

    /// Whether what is seen there is a reflector that the fault is about.
    pub(super) fn is_chosen(&self, seen: &ReflectorObservation) -> bool {
        let Some(sensor) = self.sensor(seen.time).filter(|_| !self.chosen.is_empty()) else { return false };
        let (sine, cosine) = libm::sincos(f64::from(seen.bearing));
        let place = sensor.transform(&(Point::new(cosine, sine) * f64::from(seen.range)));
        let distance = |landmark: &Landmark| (landmark.position() - place).norm();
        let nearest = self.landmarks.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
        nearest.is_some_and(|landmark| distance(landmark) < SAME && self.chosen.contains(&landmark.id))
    }

    /// Shows what the revolution before has shown instead, as far as it goes, if `is_wanted`, and remembers what was seen.
    pub(super) fn repeat(&mut self, seen: &mut Vec<ReflectorObservation>, is_wanted: bool) {
        let now = seen.iter().map(|seen| (seen.bearing, seen.range)).collect();
        let before = std::mem::replace(&mut self.shown, now);
        if is_wanted && !before.is_empty() {
            seen.truncate(before.len());
            for (seen, (bearing, range)) in seen.iter_mut().zip(before) {
                (seen.bearing, seen.range) = (bearing, range);
            }
        }
    }

    /// People, seen from the laser, `time` s after the vehicle drove off.
    pub(super) fn people(&self, time: f64) -> impl Iterator<Item = Point> + '_ {
        self.walkers.at(time)
    }

    /// An error of this standard deviation that decays to the e-th part in so many seconds, the same for all of one time.
    pub(super) fn wandering(&mut self, deviation: f64, seconds: f64, time: f64, random: &mut Random) -> f64 {
        if self.wandered_at != Some(time) {
            let kept = self.wandered_at.map_or(0.0, |before| libm::exp(-(time - before).max(0.0) / seconds.max(1e-9)));
            self.wander = kept * self.wander + libm::sqrt(1.0 - kept * kept) * random.normal();
            self.wandered_at = Some(time);
        }
        deviation * self.wander
    }
}

/// People that go around the vehicle, seen from it.
struct Walkers(Vec<[f64; 4]>);

impl Walkers {
    fn new(what: FaultKind, random: &mut Random) -> Self {
        let count = if let FaultKind::PeopleShine { count } = what { count } else { 0 };
        let mut walker = || {
            let start = random.between(-3.1, 3.1);
            [start, random.between(2.0, 12.0), random.between(-0.3, 0.3), random.between(-0.8, 0.8)]
        };
        Self((0..count).map(|_| walker()).collect())
    }

    fn at(&self, time: f64) -> impl Iterator<Item = Point> + '_ {
        self.0.iter().map(move |[bearing, range, turn, speed]| {
            let range = (range + speed * libm::sin(time)).max(1.0);
            let (sine, cosine) = libm::sincos(bearing + turn * time);
            Point::new(cosine, sine) * range
        })
    }
}

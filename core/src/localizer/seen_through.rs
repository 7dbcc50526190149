//! Places of mapped reflectors through which the beams of scans have passed: no reflector stands there, or it would have stopped
//! them.

use heapless::Vec;

use crate::geometry::{Point, Pose};
use crate::maps::MapView;
use crate::measurement::Scan;

/// Most places that are remembered.
const PLACES: usize = 16;
/// Reflectors are looked for between these ranges, m: farther ones may be too weak to be detected.
const RANGES: (f64, f64) = (1.0, 15.0);
/// A beam has passed if it ends so far behind the place, m: no wall or post close to it is meant.
const BEHIND: f64 = 0.5;
/// All beams that pass the place within this distance, m, and this turn, rad, must have passed: that is how far the laser moves
/// and turns in half a revolution, and the error of the pose.
const BESIDE: (f64, f64) = (0.2, 0.02);
/// Reflectors that are closer to each other, m, may have been taken for one.
const APART: f64 = 1.0;
/// In so many scans a place must have been passed.
const SCANS: u8 = 4;
/// A reflector that was seen is the mapped one within this distance, m.
const SAME: f64 = 0.5;

/// How many scans have passed which place, by the number of the reflector in the map.
#[derive(Clone, Debug)]
pub(super) struct SeenThrough {
    places: Vec<(u16, u8), PLACES>,
}

impl SeenThrough {
    /// Nothing was looked at.
    pub(super) const fn new() -> Self {
        Self { places: Vec::new() }
    }

    /// Forgets all places.
    pub(super) fn forget(&mut self) {
        self.places.clear();
    }

    /// Takes a scan whose laser is at `sensor` in W. A reflector that stands at its place stops the beams, so it takes no room; what
    /// exceeds the room is left out, since as many missing ones tell enough.
    pub(super) fn look(&mut self, scan: &Scan, sensor: &Pose, reflectors: MapView) {
        for (number, landmark) in (0..u16::MAX).zip(reflectors.landmarks()) {
            let place = landmark.position();
            let is_alone = reflectors.near(place, APART).nth(1).is_none();
            if !(is_alone && passes(scan, &sensor.inverse_transform(&place))) {
                continue;
            }
            match self.places.iter_mut().find(|(known, _)| *known == number) {
                Some((_, scans)) => *scans = scans.saturating_add(1),
                None => _ = self.places.push((number, 1)),
            }
        }
    }

    /// Whether a reflector is missing: its place was passed, and none of those that were `seen`, in W, is there.
    pub(super) fn is_any_missing(&self, reflectors: MapView, seen: impl Iterator<Item = Point> + Clone) -> bool {
        let passed = self.places.iter().filter(|(_, scans)| *scans >= SCANS);
        passed
            .filter_map(|(number, _)| reflectors.landmarks().get(usize::from(*number)))
            .any(|landmark| seen.clone().all(|place| (place - landmark.position()).norm() > SAME))
    }
}

/// Whether all beams toward a place in S end behind it.
fn passes(scan: &Scan, place: &Point) -> bool {
    (RANGES.0..=RANGES.1).contains(&libm::hypot(place.x, place.y)) && scan.passes(place, BESIDE, BEHIND)
}

//! Stored places: scans with the poses at which they were taken, and finding out at which of them another scan was taken.

use std::path::Path;

use agv_core::geometry::{Pose, ScanPoint};
use agv_core::measurement::{LaserId, Time};
use agv_core::sensing::falko::{Detector, Parameters};
use agv_core::sensing::{Keypoint, PointScan};
use agv_places::{
    Candidate, Glare, GlareParameters, GlareTables, PlaceIndex, PlaceView, RecognitionParameters, Recognizer,
};
use serde::{Deserialize, Serialize};

use crate::import::{BEAMS, KEYPOINTS, PosedScan, RANGES};
use crate::output_file;
use crate::recording::RecordedScan;
use crate::text_file::{self, TextFileError};

/// Most places of a file.
pub const PLACES: usize = 8192;
/// Most candidates of a question.
pub const CANDIDATES: usize = 64;

/// Answers with at least this confidence are accepted where the scan before is stored too, as in the protocol of the thesis;
/// chosen on fr079 and intel, the same for all halls.
pub const LEAST_CONFIDENCE: f64 = 0.5;

/// Answers with at least this confidence are believed where the vehicle may be anywhere, and nowhere near a stored place;
/// chosen on fr079, the same for all halls.
pub const SURE_CONFIDENCE: f32 = 0.75;

/// First words of a file of places.
const FORMAT: &str = "agv places 1";

/// A place as it is stored.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StoredPlace {
    /// Pose of S in W: x, y (m) and heading (rad).
    pub pose: [f64; 3],
    /// Direction of the first beam in S, rad.
    pub first_bearing: f64,
    /// Angle between neighbouring beams, rad.
    pub bearing_step: f64,
    /// Range of each beam, mm; zero where there is no return.
    pub ranges_mm: Vec<u32>,
}

#[derive(Serialize, Deserialize)]
struct File {
    format: String,
    places: Vec<StoredPlace>,
}

/// Scans further apart than this (m, rad) from all stored ones become places.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spacing {
    /// Distance, m.
    pub shift: f64,
    /// Turn, rad.
    pub turn: f64,
}

/// Chooses scans as places: each one that is far enough from those chosen before, as long as there is room.
#[must_use]
pub fn choose(scans: &[PosedScan], spacing: Spacing) -> Vec<StoredPlace> {
    let mut chosen: Vec<&PosedScan> = Vec::new();
    for scan in scans {
        let is_near = |other: &&PosedScan| {
            let apart = other.laser.between(&scan.laser);
            apart.position().norm() < spacing.shift && apart.theta.abs() < spacing.turn
        };
        if chosen.len() < PLACES && !chosen.iter().any(is_near) {
            chosen.push(scan);
        }
    }
    let stored = chosen.into_iter().map(|scan| StoredPlace {
        pose: [scan.laser.x, scan.laser.y, scan.laser.theta],
        first_bearing: scan.scan.first_bearing,
        bearing_step: scan.scan.bearing_step,
        ranges_mm: scan.scan.ranges.iter().map(|range| (f64::from(*range) * 1e3).round().max(0.0) as u32).collect(),
    });
    stored.collect()
}

/// Writes places; an older file of that name is replaced.
///
/// # Errors
/// If the file cannot be written.
pub fn write(path: &Path, places: Vec<StoredPlace>) -> Result<(), TextFileError> {
    let file = File { format: FORMAT.to_owned(), places };
    let text = serde_json::to_string(&file).map_err(|error| TextFileError::of_system(path, error.into()))?;
    output_file::write(path, text).map_err(|source| TextFileError::of_system(path, source))
}

/// Reads places.
///
/// # Errors
/// If the file cannot be read, or holds something else.
pub fn read(path: &Path) -> Result<Vec<StoredPlace>, TextFileError> {
    let text = text_file::read(path, "a file of places")?;
    let foreign = || TextFileError::of_line(path, 1, "this is no file of places that 'agv places index' has written");
    let file: File = serde_json::from_str(&text).map_err(|_| foreign())?;
    let is_sound = |place: &StoredPlace| {
        let numbers = [place.first_bearing, place.bearing_step];
        numbers.iter().chain(&place.pose).all(|number| number.is_finite()) && place.bearing_step > 0.0
    };
    if file.format != FORMAT || file.places.len() > PLACES || !file.places.iter().all(is_sound) {
        return Err(foreign());
    }
    Ok(file.places)
}

/// A scan as the search of places sees it.
#[derive(Clone, Debug)]
pub struct Observation {
    /// Points, in S.
    pub points: Box<PointScan<BEAMS>>,
    /// Keypoints, in S.
    pub keypoints: Vec<Keypoint>,
}

impl Observation {
    /// What the recognition of places takes.
    #[must_use]
    pub fn view(&self) -> PlaceView<'_, BEAMS> {
        PlaceView { points: &self.points, keypoints: &self.keypoints }
    }

    /// The signature of the keypoints.
    #[must_use]
    pub fn signature(&self, tables: &GlareTables) -> Glare {
        let positions: Vec<ScanPoint> = self.keypoints.iter().map(|keypoint| keypoint.position).collect();
        Glare::of(&positions, tables)
    }
}

/// Finds the keypoints by which places are recognised: corners, and ends of faces.
pub struct Observer {
    detectors: [Box<Detector<BEAMS>>; 2],
}

impl Default for Observer {
    fn default() -> Self {
        let detectors = [Parameters::place_corners(), Parameters::place_ends()];
        Self { detectors: detectors.map(|parameters| Box::new(Detector::new(parameters))) }
    }
}

impl Observer {
    /// Observes a scan.
    pub fn observe(&mut self, scan: &RecordedScan) -> Observation {
        let mut points = Box::new(PointScan::new());
        points.set(&scan.view(), RANGES.0, RANGES.1);
        let mut keypoints = Vec::new();
        let mut found = heapless::Vec::<Keypoint, KEYPOINTS>::new();
        for detector in &mut self.detectors {
            detector.detect(&points, &mut found);
            keypoints.extend_from_slice(&found);
        }
        Observation { points, keypoints }
    }
}

/// Where a scan was taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlaceFix {
    /// Number of the place that it looks like.
    pub place: usize,
    /// Pose of S in W.
    pub pose: Pose,
    /// How sure that is, 0 to 1.
    pub confidence: f32,
    /// Keypoints that both have.
    pub points: usize,
}

/// The answer to where a scan was taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PlaceAnswer {
    /// Here.
    Found(PlaceFix),
    /// Two poses fit almost equally.
    Ambiguous(PlaceFix, PlaceFix),
    /// At no stored place.
    Unknown,
}

/// When an answer is believed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FindParameters {
    /// Places that are looked at.
    pub candidates: usize,
    /// Least confidence.
    pub least_confidence: f32,
    /// Fewest keypoints that both scans have.
    pub fewest_points: usize,
}

impl Default for FindParameters {
    fn default() -> Self {
        Self { candidates: 10, least_confidence: SURE_CONFIDENCE, fewest_points: 5 }
    }
}

/// Another pose whose confidence comes this near to that of the best makes the answer ambiguous.
const LEAST_GAP: f32 = 0.1;

/// Poses closer than this are one, m and rad.
const SAME_POSE: (f64, f64) = (0.5, 0.2);

/// Places that can be searched.
pub struct PlaceMap {
    poses: Vec<Pose>,
    observations: Vec<Observation>,
    index: Box<PlaceIndex<PLACES>>,
    tables: GlareTables,
    recognizer: Box<Recognizer<1024, 32>>,
}

impl PlaceMap {
    /// Prepares stored places for the search.
    #[must_use]
    pub fn new(places: &[StoredPlace]) -> Self {
        let mut observer = Observer::default();
        let tables = GlareTables::new(&GlareParameters::default());
        let mut index = Box::new(PlaceIndex::new());
        let observations: Vec<_> = places
            .iter()
            .take(PLACES)
            .map(|place| {
                let observation = observer.observe(&RecordedScan {
                    laser: LaserId::FIRST,
                    start: Time::default(),
                    beam_interval: 0.0,
                    first_bearing: place.first_bearing,
                    bearing_step: place.bearing_step,
                    ranges: place.ranges_mm.iter().map(|range| (f64::from(*range) * 1e-3) as f32).collect(),
                    intensities: Vec::new(),
                });
                // No more places are taken than there is room for.
                let _ = index.push(observation.signature(&tables));
                observation
            })
            .collect();
        let poses = places.iter().map(|place| Pose::new(place.pose[0], place.pose[1], place.pose[2])).collect();
        Self { poses, observations, index, tables, recognizer: Box::default() }
    }

    /// Where a scan was taken.
    pub fn find(&mut self, query: &Observation, parameters: &FindParameters) -> PlaceAnswer {
        let mut candidates = heapless::Vec::<Candidate, CANDIDATES>::new();
        self.index.search(&query.signature(&self.tables), |_| true, &mut candidates);
        let mut found = Vec::new();
        for candidate in candidates.iter().take(parameters.candidates) {
            let place = candidate.place as usize;
            let (Some(stored), Some(pose)) = (self.observations.get(place), self.poses.get(place)) else { continue };
            let recognised =
                self.recognizer.recognise(&query.view(), &stored.view(), &RecognitionParameters::default());
            let fix = recognised.map(|recognised| PlaceFix {
                place,
                pose: pose.compose(&recognised.pose),
                confidence: recognised.confidence(),
                points: recognised.points,
            });
            found.extend(fix.filter(|fix| fix.points >= parameters.fewest_points));
        }
        found.sort_by(|a, b| b.confidence.total_cmp(&a.confidence));
        let Some(best) = found.first().filter(|best| best.confidence >= parameters.least_confidence) else {
            return PlaceAnswer::Unknown;
        };
        let is_other = |fix: &&PlaceFix| {
            let apart = best.pose.between(&fix.pose);
            apart.position().norm() > SAME_POSE.0 || apart.theta.abs() > SAME_POSE.1
        };
        match found.iter().find(is_other) {
            Some(other) if best.confidence - other.confidence < LEAST_GAP => PlaceAnswer::Ambiguous(*best, *other),
            _ => PlaceAnswer::Found(*best),
        }
    }
}

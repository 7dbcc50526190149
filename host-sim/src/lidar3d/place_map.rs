//! Stored places: signatures of key scans, and finding out at which of them another scan was taken.

use std::path::Path;

use agv_lidar3d::place::{
    BINS, DIRECTIONS, ENRICHED_LENGTH, Enriched, Facing, Histogram, Orientation, Panorama, PlaceImage, Span,
    from_key_scans,
};
use serde::{Deserialize, Serialize};

use super::signatures::{Method, Signatures};
use super::view::{Standing, View};
use crate::output_file;
use crate::text_file::TextFileError;

/// Places so far apart are different ones, m.
pub const APART: f64 = 30.0;
/// Key scans so many numbers apart are of different places where no poses are known (M 5.2.1: 15).
const NUMBERS_APART: usize = 15;

/// Places from which the greatest difference of the walls is learned, at the most: it takes a tenth of a millisecond a pair.
const LEARNING_PLACES: usize = 128;

/// First bytes of a file of places: of this program, and their version.
const MAGIC: [u8; 8] = *b"AGVP3D\x03\n";

/// The same of files without images and panoramas, and of those whose limit is one of scores.
const OLDER: [[u8; 8]; 2] = [*b"AGVP3D\x01\n", *b"AGVP3D\x02\n"];

/// A place as it is stored.
#[derive(Clone, Debug)]
pub struct StoredPlace {
    /// Number of the scan in its recording.
    pub scan: usize,
    /// Where it was taken: x, y (m) and heading (rad) of the sensor, if that is known.
    pub pose: Option<[f64; 3]>,
    /// Its signatures.
    pub signatures: Signatures,
    /// What it looks like.
    pub view: View,
}

/// Places that can be searched.
#[derive(Clone, Debug)]
pub struct PlaceMap {
    /// How the sensor stands above the floor.
    pub standing: Standing,
    /// Its rings.
    pub rings: usize,
    /// Between which elevations it looks.
    pub span: Span,
    /// The agreement of what is visible from which on answers are believed, if it was learnt.
    pub limit: Option<f32>,
    /// The places.
    pub places: Vec<StoredPlace>,
}

/// When an answer is believed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Greatest distance of the signatures.
    pub distance: f64,
    /// Greatest difference of the directions in which the walls face; None if that is not asked.
    pub facing: Option<f64>,
}

/// Where a scan was taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Answer {
    /// Number of the place that it looks most like.
    pub place: usize,
    /// How far apart the signatures are.
    pub distance: f64,
    /// Whether that is less than any two different places of the map are apart.
    pub is_believed: bool,
    /// By which the sensor has turned to the left since, rad.
    pub turn: f64,
}

impl PlaceMap {
    /// The place that a scan looks most like. None if there are no places.
    #[must_use]
    pub fn find(&self, method: Method, limits: &Limits, query: &Signatures) -> Option<Answer> {
        let distances = self.places.iter().map(|place| method.distance(query, &place.signatures)).enumerate();
        let (place, distance) = distances.min_by(|a, b| a.1.total_cmp(&b.1))?;
        let stored = &self.places[place].signatures;
        let faces_alike = |limit: f64| f64::from(stored.facing.distance(&query.facing)) < limit;
        let is_believed = distance < limits.distance && limits.facing.is_none_or(faces_alike);
        Some(Answer { place, distance, is_believed, turn: query.turn_since(stored) })
    }

    /// The greatest distance at which a method is believed, learned from the map: 0.8 times the least one between two of
    /// its places that are more than 30 m apart, or, if their poses are not known, more than 15 numbers. None if the map is
    /// too small for it.
    #[must_use]
    pub fn threshold(&self, method: Method) -> Option<f64> {
        self.learn(1, |one, other| method.distance(one, other))
    }

    /// The same of the directions in which walls face, from some of the places of a large map.
    #[must_use]
    pub fn facing_threshold(&self) -> Option<f64> {
        let step = self.places.len().div_ceil(LEARNING_PLACES).max(1);
        self.learn(step, |one, other| f64::from(one.facing.distance(&other.facing)))
    }

    fn learn(&self, step: usize, distance: impl Fn(&Signatures, &Signatures) -> f64) -> Option<f64> {
        let places: Vec<&StoredPlace> = self.places.iter().step_by(step).collect();
        let distance = |one: usize, other: usize| distance(&places[one].signatures, &places[other].signatures);
        let poses: Option<Vec<[f64; 2]>> = places.iter().map(|place| place.pose.map(|[x, y, _]| [x, y])).collect();
        match poses {
            Some(poses) => from_key_scans(&poses, APART, distance),
            None => {
                let numbers: Vec<[f64; 2]> = (0..places.len()).map(|number| [(step * number) as f64, 0.0]).collect();
                from_key_scans(&numbers, NUMBERS_APART as f64, distance)
            }
        }
    }

    /// Distance from a place to the next one, m, at the median; None if no two of them have poses.
    #[must_use]
    pub fn spacing(&self) -> Option<f64> {
        let pairs = self.places.iter().zip(self.places.iter().skip(1));
        let apart = pairs.filter_map(|(one, other)| Some((one.pose?, other.pose?)));
        let mut apart: Vec<f64> = apart.map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1])).collect();
        apart.sort_by(f64::total_cmp);
        apart.get(apart.len() / 2).copied()
    }
}

/// What stands for a share of one.
const FACING_SCALE: f32 = 65_535.0;

#[derive(Serialize, Deserialize)]
struct File {
    sensor_height: f32,
    is_height_given: bool,
    rings: u16,
    /// Least and greatest elevation, rad.
    span: [f32; 2],
    limit: Option<f32>,
    places: Vec<Entry>,
}

#[derive(Serialize, Deserialize)]
struct Entry {
    scan: u32,
    pose: Option<[f64; 3]>,
    histogram: Vec<u32>,
    enriched: Vec<i8>,
    /// Distances by direction, cm.
    orientation: Vec<u16>,
    /// Walls by direction, in 1/65535.
    facing: Vec<u16>,
    image: Vec<u8>,
    panorama: Vec<u8>,
    /// Of the sensor above the floor, m.
    height: f32,
}

/// Writes places; an older file of that name is replaced.
///
/// # Errors
/// If the file cannot be written.
pub fn write(path: &Path, map: &PlaceMap) -> Result<(), TextFileError> {
    let places = map.places.iter().map(|place| Entry {
        scan: place.scan as u32,
        pose: place.pose,
        histogram: place.signatures.counts.0.iter().map(|count| *count as u32).collect(),
        enriched: place.signatures.enriched.0.to_vec(),
        orientation: place.signatures.orientation.0.iter().map(|range| (100.0 * range).round() as u16).collect(),
        facing: place.signatures.facing.0.iter().map(|share| (FACING_SCALE * share).round() as u16).collect(),
        image: place.view.image.to_bytes().to_vec(),
        panorama: place.view.panorama.to_bytes().to_vec(),
        height: place.view.panorama.height(),
    });
    let file = File {
        sensor_height: map.standing.height(),
        is_height_given: matches!(map.standing, Standing::Given(_)),
        rings: map.rings as u16,
        span: [map.span.least, map.span.most],
        limit: map.limit,
        places: places.collect(),
    };
    let failed = |reason: String| TextFileError::of_system(path, std::io::Error::other(reason));
    let bytes = postcard::to_extend(&file, MAGIC.to_vec()).map_err(|error| failed(error.to_string()))?;
    output_file::write(path, bytes).map_err(|source| TextFileError::of_system(path, source))
}

/// Reads places.
///
/// # Errors
/// If the file cannot be read, or holds something else.
pub fn read(path: &Path) -> Result<PlaceMap, TextFileError> {
    let bytes = std::fs::read(path).map_err(|source| TextFileError::of_system(path, source))?;
    let foreign =
        || TextFileError::of_line(path, 1, "this is no file of places that 'agv lidar3d places index' has written");
    let old = || TextFileError::of_line(path, 1, "an older version has stored these places: index them again");
    let body = bytes
        .strip_prefix(&MAGIC)
        .ok_or_else(|| if OLDER.iter().any(|older| bytes.starts_with(older)) { old() } else { foreign() })?;
    let file: File = postcard::from_bytes(body).map_err(|_| foreign())?;
    map(&file).ok_or_else(foreign)
}

fn map(file: &File) -> Option<PlaceMap> {
    let height = file.sensor_height;
    let [least, most] = file.span;
    let is_sound = height.is_finite() && least < most && file.rings > 0;
    let (span, rings) = (Span { least, most }, usize::from(file.rings));
    let places: Option<Vec<StoredPlace>> = file.places.iter().map(|entry| place(entry, rings, span)).collect();
    is_sound.then_some(PlaceMap {
        standing: if file.is_height_given { Standing::Given(height) } else { Standing::Found(height) },
        rings,
        span,
        limit: file.limit.filter(|limit| limit.is_finite()),
        places: places?,
    })
}

fn place(entry: &Entry, rings: usize, span: Span) -> Option<StoredPlace> {
    let histogram: [u32; BINS] = entry.histogram.as_slice().try_into().ok()?;
    let enriched: [i8; ENRICHED_LENGTH] = entry.enriched.as_slice().try_into().ok()?;
    let orientation: [u16; DIRECTIONS] = entry.orientation.as_slice().try_into().ok()?;
    let facing: [u16; DIRECTIONS] = entry.facing.as_slice().try_into().ok()?;
    let image = PlaceImage::from_bytes(entry.image.as_slice().try_into().ok()?)?;
    let panorama = Panorama::from_bytes(entry.panorama.as_slice().try_into().ok()?, rings, span, entry.height);
    if !entry.height.is_finite() || entry.pose.is_some_and(|pose| !pose.iter().all(|value| value.is_finite())) {
        return None;
    }
    let counts = Histogram(histogram.map(f64::from));
    let signatures = Signatures {
        shares: counts.normalised(),
        counts,
        enriched: Enriched(enriched),
        orientation: Orientation(orientation.map(|range| 0.01 * f32::from(range))),
        facing: Facing(facing.map(|share| f32::from(share) / FACING_SCALE)),
    };
    Some(StoredPlace { scan: entry.scan as usize, pose: entry.pose, signatures, view: View { image, panorama } })
}

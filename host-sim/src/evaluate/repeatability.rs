//! Viewpoint repeatability of keypoints (K 3.3): of the keypoints of two scans that see much the same space, how many
//! are the same points of the world.

use std::collections::HashSet;

use agv_core::geometry::{Point, Pose};
use agv_core::measurement::Scan;
use geo::{Area, BooleanOps, LineString, Polygon};
use rayon::prelude::*;

use crate::import::PosedScan;

/// Every scan whose index is a multiple of this is a reference.
pub const EVERY: usize = 4;
/// Beams longer than this do not bound the free region, m.
pub const FARTHEST: f64 = 30.0;
/// Beams shorter than this do not bound the free region, m.
const NEAREST: f64 = 0.02;
/// Scans taken at most this far apart are compared, m.
const NEIGHBOURHOOD: f64 = 1.0;
/// Smallest overlap of two free regions: area of the intersection over that of the union.
const LEAST_OVERLAP: f64 = 0.5;
/// Keypoints closer than this are the same, m.
const MATCH: f64 = 0.2;

/// Repeatability of the keypoints of one detector.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Repeatability {
    /// Mean over pairs of scans that both have keypoints; NaN if there is none.
    pub excluding_empty: f64,
    /// Mean over all pairs; one in which a scan has no keypoint counts as zero. NaN if there is no pair.
    pub counting_empty: f64,
    /// Number of pairs.
    pub pairs: usize,
}

/// Pairs of scans that see much the same space, by index; the first one is the reference.
#[must_use]
pub fn overlapping_pairs(scans: &[PosedScan]) -> Vec<(usize, usize)> {
    let regions: Vec<_> = scans.par_iter().map(|scan| free_region(&scan.scan.view(), &scan.laser)).collect();
    let references: Vec<_> = (0..scans.len()).step_by(EVERY).collect();
    let found = references.into_par_iter().flat_map_iter(|reference| {
        let regions = &regions;
        (0..scans.len()).filter_map(move |other| {
            let apart = scans[other].laser.position() - scans[reference].laser.position();
            if other == reference || apart.norm() > NEIGHBOURHOOD {
                return None;
            }
            let (first, second) = (regions[reference].as_ref()?, regions[other].as_ref()?);
            (overlap(first, second) >= LEAST_OVERLAP).then_some((reference, other))
        })
    });
    found.collect()
}

/// Scores keypoints, given per scan in the frame of its laser.
#[must_use]
pub fn score(scans: &[PosedScan], keypoints: &[Vec<Point>], pairs: &[(usize, usize)]) -> Repeatability {
    let world: Vec<Vec<Point>> = scans
        .iter()
        .zip(keypoints)
        .map(|(scan, points)| points.iter().map(|point| scan.laser.transform(point)).collect())
        .collect();
    let shares: Vec<_> = pairs
        .par_iter()
        .filter_map(|&(reference, other)| {
            let (first, second) = (&world[reference], &world[other]);
            let smaller = first.len().min(second.len());
            (smaller > 0).then(|| matches(first, second) as f64 / smaller as f64)
        })
        .collect();
    let sum: f64 = shares.iter().sum();
    Repeatability {
        excluding_empty: sum / shares.len() as f64,
        counting_empty: sum / pairs.len() as f64,
        pairs: pairs.len(),
    }
}

/// The region that the beams of a scan have crossed, in the world. None for fewer than three usable beams.
fn free_region(scan: &Scan<'_>, laser: &Pose) -> Option<Polygon> {
    let rim = scan.ranges.iter().enumerate().filter_map(|(index, &range)| {
        let range = f64::from(range);
        let is_usable = range.is_finite() && range < FARTHEST && range > NEAREST;
        is_usable.then(|| {
            let (sine, cosine) = scan.bearing(index).sin_cos();
            laser.transform(&Point::new(range * cosine, range * sine))
        })
    });
    let ring: Vec<_> = std::iter::once(laser.position()).chain(rim).map(|point| (point.x, point.y)).collect();
    (ring.len() > 3).then(|| Polygon::new(LineString::from(ring), Vec::new()))
}

fn overlap(first: &Polygon, second: &Polygon) -> f64 {
    let shared = first.intersection(second).unsigned_area();
    let union = first.unsigned_area() + second.unsigned_area() - shared;
    if union > 0.0 { shared / union } else { 0.0 }
}

/// Number of pairs matched greedily, nearest first, one to one.
fn matches(first: &[Point], second: &[Point]) -> usize {
    let mut near: Vec<_> = first
        .iter()
        .enumerate()
        .flat_map(|(i, a)| second.iter().enumerate().map(move |(j, b)| ((a - b).norm(), i, j)))
        .filter(|(distance, _, _)| *distance < MATCH)
        .collect();
    near.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut used_first, mut used_second) = (HashSet::new(), HashSet::new());
    for (_, i, j) in near {
        if !used_first.contains(&i) && !used_second.contains(&j) {
            used_first.insert(i);
            used_second.insert(j);
        }
    }
    used_first.len()
}

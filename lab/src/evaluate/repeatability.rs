//! Viewpoint repeatability of keypoints (K 3.3): of the keypoints of two scans that see much the same space, how many
//! are the same points of the world.

use std::collections::HashSet;

use agv_core::geometry::{Point, Pose};
use agv_core::measurement::Scan;
use geo::{Area, BooleanOps, LineString, Polygon};
use rayon::prelude::*;

use agv_host_sim::import::PosedScan;

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

/// Two scans that see much the same space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OverlappingPair {
    /// Index of the reference scan.
    pub reference: usize,
    /// Index of the other scan.
    pub other: usize,
    /// Area of the intersection of their free regions over that of the union.
    pub overlap: f64,
}

/// Pairs of scans that see much the same space.
#[must_use]
pub fn overlapping_pairs(scans: &[PosedScan]) -> Vec<OverlappingPair> {
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
            let overlap = overlap(first, second);
            (overlap >= LEAST_OVERLAP).then_some(OverlappingPair { reference, other, overlap })
        })
    });
    found.collect()
}

/// Scores keypoints, given per scan in the frame of its laser.
#[must_use]
pub fn score(scans: &[PosedScan], keypoints: &[Vec<Point>], pairs: &[OverlappingPair]) -> Repeatability {
    let world: Vec<Vec<Point>> = scans
        .iter()
        .zip(keypoints)
        .map(|(scan, points)| points.iter().map(|point| scan.laser.transform(point)).collect())
        .collect();
    let shares: Vec<_> =
        pairs.par_iter().filter_map(|pair| share(&world[pair.reference], &world[pair.other])).collect();
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

/// Share of the smaller one of two sets of keypoints in one frame that the other has too. None if one is empty.
#[must_use]
pub fn share(first: &[Point], second: &[Point]) -> Option<f64> {
    let smaller = first.len().min(second.len());
    (smaller > 0).then(|| same_points(first, second).len() as f64 / smaller as f64)
}

/// Keypoints of both sets that are the same point: matched greedily, nearest first, one to one.
#[must_use]
pub fn same_points(first: &[Point], second: &[Point]) -> Vec<(usize, usize)> {
    let mut near: Vec<_> = first
        .iter()
        .enumerate()
        .flat_map(|(i, a)| second.iter().enumerate().map(move |(j, b)| ((a - b).norm(), i, j)))
        .filter(|(distance, _, _)| *distance < MATCH)
        .collect();
    near.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut used_first, mut used_second) = (HashSet::new(), HashSet::new());
    near.retain(|&(_, i, j)| {
        let is_free = !used_first.contains(&i) && !used_second.contains(&j);
        if is_free {
            used_first.insert(i);
            used_second.insert(j);
        }
        is_free
    });
    near.into_iter().map(|(_, i, j)| (i, j)).collect()
}

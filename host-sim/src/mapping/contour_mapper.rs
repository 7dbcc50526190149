//! Maps of contours from scans whose poses are known: in each cell the mean of the points that face the same way.

use std::collections::BTreeMap;

use agv_core::contours::{SurfacePoint, find_surface_points};
use agv_core::geometry::{Point, Pose};
use agv_core::measurement::Time;
use agv_core::sensing::{PointScan, SensorPath};
use heapless::Vec as BoundedVec;

use super::poses_by_reflectors;
use crate::contour_map::{ContourMap, MapPoint};
use crate::import::RANGES;
use crate::recording::{RecordedEvent, RecordedScan, Recording, Truth, truth_at};
use crate::replay::ReplayError;

/// Beams of the longest scan that is looked at.
const BEAMS: usize = 1440;

/// Points of a scan that are mapped.
const POINTS: usize = 1440;

/// Size of a cell, m.
pub const CELL: f64 = 0.2;

/// Cosine of the angle up to which normals are of one surface.
const ALIKE: f64 = 0.848;

/// What was seen less often than this share of what was seen most often in the same cell is noise, or has passed by.
const LEAST_SHARE: f64 = 0.2;

/// Points of one surface in one cell.
#[derive(Clone, Copy, Debug)]
struct Cluster {
    count: f64,
    position: Point,
    normal: Point,
}

/// Collects the points of scans by cell.
#[derive(Clone, Debug)]
pub struct ContourMapper {
    cell: f64,
    cells: BTreeMap<(i64, i64), Vec<Cluster>>,
    points: BoundedVec<SurfacePoint, POINTS>,
    scan: PointScan<BEAMS>,
}

impl ContourMapper {
    /// A mapper with cells of that size, m.
    #[must_use]
    pub fn new(cell: f64) -> Self {
        Self { cell, cells: BTreeMap::new(), points: BoundedVec::new(), scan: PointScan::new() }
    }

    /// Adds a scan whose beams were simultaneous, or along a path, from a known pose of the laser at its first beam.
    pub fn add(&mut self, scan: &RecordedScan, laser: &Pose, path: Option<&SensorPath>) {
        self.scan.set(&scan.view(), RANGES.0, RANGES.1);
        if let Some(path) = path {
            path.correct(&scan.view(), &mut self.scan);
        }
        find_surface_points(self.scan.view(), &mut self.points);
        for point in &self.points {
            let normal = laser.transform(&point.normal.cast()) - laser.position();
            let position = laser.transform(&point.position.cast());
            let index = |length: f64| (length / self.cell).floor() as i64;
            let clusters = self.cells.entry((index(position.y), index(position.x))).or_default();
            let is_alike = |cluster: &&mut Cluster| {
                let is_corner = cluster.normal == Point::zeros();
                is_corner == point.is_corner() && (is_corner || cluster.normal.normalize().dot(&normal) > ALIKE)
            };
            match clusters.iter_mut().find(is_alike) {
                Some(cluster) => {
                    cluster.count += 1.0;
                    cluster.position += position;
                    cluster.normal += if point.is_corner() { Point::zeros() } else { normal };
                }
                None => {
                    let normal = if point.is_corner() { Point::zeros() } else { normal };
                    clusters.push(Cluster { count: 1.0, position, normal });
                }
            }
        }
    }

    /// The map of all that was added.
    #[must_use]
    pub fn finish(&self) -> ContourMap {
        let strong = |clusters: &'_ Vec<Cluster>| {
            let most = clusters.iter().map(|cluster| cluster.count).fold(0.0, f64::max);
            clusters.iter().filter(|cluster| cluster.count >= LEAST_SHARE * most).copied().collect::<Vec<_>>()
        };
        let points = self.cells.values().flat_map(strong).map(|cluster| MapPoint {
            position: cluster.position / cluster.count,
            normal: if cluster.normal == Point::zeros() { cluster.normal } else { cluster.normal.normalize() },
        });
        ContourMap::of(points)
    }
}

/// A map of the scans of a recording that were taken between the first and the last of the known poses of R.
#[must_use]
pub fn map_contours_at(recording: &Recording, poses: &[Truth], cell: f64) -> ContourMap {
    map_contours_where(recording, |time| truth_at(poses, time), cell)
}

/// A map of the scans that were taken while reflectors told where the vehicle was.
///
/// # Errors
/// [`ReplayError`] if the recording cannot be replayed.
pub fn map_contours(recording: &Recording, cell: f64) -> Result<ContourMap, ReplayError> {
    let poses = poses_by_reflectors(recording)?;
    let at = |time: Time| {
        let next = poses.partition_point(|pose| pose.time < time);
        let (before, after) = (poses.get(next.checked_sub(1)?)?, poses.get(next)?);
        (after.time.since(before.time) <= LONGEST_GAP).then(|| truth_at(&poses, time)).flatten()
    };
    Ok(map_contours_where(recording, at, cell))
}

/// Poses by reflectors that are further apart, s, tell nothing of the time between them.
const LONGEST_GAP: f64 = 0.25;

/// A map of the scans during which the pose of R is known.
fn map_contours_where(recording: &Recording, pose_at: impl Fn(Time) -> Option<Pose>, cell: f64) -> ContourMap {
    let mut mapper = ContourMapper::new(cell);
    for event in &recording.events {
        let RecordedEvent::Scan(scan) = event else { continue };
        let Some(mount) = recording.parameters.lasers.mount(scan.laser) else { continue };
        let Some(start) = pose_at(scan.start) else { continue };
        let end = scan.view().end();
        let steps = if end > scan.start { PATH_STEPS } else { 0 };
        let times =
            (0..=steps).map(|step| scan.start.offset(end.since(scan.start) * f64::from(step) / f64::from(PATH_STEPS)));
        let displacements: Option<Vec<_>> = times.map(|time| Some((time, start.between(&pose_at(time)?)))).collect();
        let Some(displacements) = displacements else { continue };
        let mut path = SensorPath::default();
        path.set(scan.start, mount, displacements.into_iter());
        mapper.add(scan, &start.compose(mount), Some(&path));
    }
    mapper.finish()
}

/// Places along the way during a revolution.
const PATH_STEPS: u32 = 8;

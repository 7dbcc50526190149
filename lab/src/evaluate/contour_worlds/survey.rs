//! What a laser measures in such a world, and the map that is made of it from known poses.

use std::collections::HashSet;
use std::f64::consts::{PI, TAU};

use agv_core::geometry::{Point, Pose};
use agv_core::measurement::{LaserId, Time};
use agv_host_sim::contour_map::ContourMap;
use agv_host_sim::mapping::contour_mapper::{CELL, ContourMapper};
use agv_host_sim::recording::RecordedScan;
use agv_host_sim::simulate::random::Random;
use agv_host_sim::simulate::raycast::RayCaster;

use super::sites::Site;

/// Beams of a revolution.
pub(super) const BEAMS: usize = 1440;

/// Angle between two of them, rad.
const BEARING_STEP: f64 = TAU / BEAMS as f64;

/// Reach, m, and standard deviation of a range, m.
const FARTHEST: f64 = 60.0;
pub(super) const RANGE_NOISE: f64 = 0.01;

/// The map is made of scans so far apart along both axes, m.
const SPACING: f64 = 2.0;

/// The scan of a vehicle that stands, of a laser at `pose`.
pub(super) fn scan(caster: &RayCaster, pose: &Pose, start: Time, random: &mut Random) -> RecordedScan {
    revolution(caster, |_| *pose, (start, 0.0), random)
}

/// The scan of a laser that is at `pose_of` while it sends a beam; its first beam, and the time between two, s.
pub(super) fn revolution(
    caster: &RayCaster,
    pose_of: impl Fn(usize) -> Pose,
    (start, beam_interval): (Time, f64),
    random: &mut Random,
) -> RecordedScan {
    let range = |beam: usize| {
        let error = RANGE_NOISE * random.normal();
        distance(caster, &pose_of(beam), beam).map_or(0.0, |distance| (distance + error) as f32)
    };
    RecordedScan {
        laser: LaserId::FIRST,
        start,
        beam_interval,
        first_bearing: -PI,
        bearing_step: BEARING_STEP,
        ranges: (0..BEAMS).map(range).collect(),
        intensities: Vec::new(),
    }
}

/// The true distance that a beam of a laser at `pose` goes, m.
pub(super) fn distance(caster: &RayCaster, pose: &Pose, beam: usize) -> Option<f64> {
    let (sine, cosine) = (pose.theta - PI + BEARING_STEP * beam as f64).sin_cos();
    caster.first_hit(&pose.position(), &Point::new(cosine, sine), FARTHEST).map(|hit| hit.distance)
}

/// The map of a world by scans from all places of a lattice where a vehicle has room.
pub(super) fn map(site: &Site, random: &mut Random) -> ContourMap {
    let (low, high) = site.floor();
    let caster = RayCaster::new(&site.world());
    let mut mapper = ContourMapper::new(CELL);
    let steps = |length: f64| (length / SPACING) as u32;
    for row in 0..=steps(high.y - low.y) {
        for column in 0..=steps(high.x - low.x) {
            let place = low + Point::new(f64::from(column) + 0.5, f64::from(row) + 0.5) * SPACING;
            // In a corridor that is narrower than the lattice there is one row.
            let place =
                Point::new(place.x, place.y.min(0.5 * (low.y + high.y) + 0.5 * (high.y - low.y - SPACING).max(0.0)));
            if site.is_free(&place) {
                let pose = Pose::new(place.x, place.y, random.between(-PI, PI));
                mapper.add(&scan(&caster, &pose, Time::default(), random), &pose, None);
            }
        }
    }
    mapper.finish()
}

/// How well a scan lies on a map: by its returns and the cells of the map's points, with nothing of the search.
pub(super) struct Overlap {
    cells: HashSet<(i32, i32)>,
}

/// A return lies on the map if a point of it is within about so much, m.
const NEAR: f64 = 0.15;

/// Returns further away do not count, m.
const COUNTED: f32 = 30.0;

impl Overlap {
    /// Of a map.
    pub(super) fn new(map: &ContourMap) -> Self {
        let mut cells = HashSet::new();
        for point in map.points() {
            let (x, y) = cell(&point.position);
            cells.extend((-1..=1).flat_map(|down| (-1..=1).map(move |right| (x + right, y + down))));
        }
        Self { cells }
    }

    /// Share of a scan's returns that lie on the map if the laser is at `pose`.
    pub(super) fn share(&self, scan: &RecordedScan, pose: &Pose) -> f64 {
        let (mut on, mut all) = (0, 0);
        for (beam, range) in scan.ranges.iter().enumerate().filter(|(_, range)| **range > 0.0 && **range < COUNTED) {
            let (sine, cosine) = scan.view().bearing(beam).sin_cos();
            let point = pose.transform(&(Point::new(cosine, sine) * f64::from(*range)));
            all += 1;
            on += u32::from(self.cells.contains(&cell(&point)));
        }
        f64::from(on) / f64::from(all.max(1))
    }
}

fn cell(point: &Point) -> (i32, i32) {
    ((point.x / NEAR).floor() as i32, (point.y / NEAR).floor() as i32)
}

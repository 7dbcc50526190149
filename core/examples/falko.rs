//! FALKO keypoints of one scan: the corners of a room of 8 m x 6 m, and the edges of a pillar in it.
#![allow(clippy::indexing_slicing, reason = "a panic is how an example ends that does not do what it says")]

use std::f64::consts::{PI, TAU};

use agv_core::geometry::Point;
use agv_core::measurement::{LaserId, Scan, Time};
use agv_core::sensing::{Keypoint, PointScan, falko};

const BEAMS: usize = 1440;
const CORNERS: [(f64, f64); 4] = [(5.0, 3.5), (-3.0, 3.5), (-3.0, -2.5), (5.0, -2.5)];
const PILLAR: [(f64, f64); 4] = [(2.0, -0.3), (2.6, -0.3), (2.6, 0.3), (2.0, 0.3)];

/// The distance from the sensor, at the origin, to the nearest of the walls in a direction.
fn range(bearing: f64) -> f64 {
    let beam = Point::new(bearing.cos(), bearing.sin());
    let cross = |a: &Point, b: &Point| a.x * b.y - a.y * b.x;
    let walls =
        [CORNERS, PILLAR].into_iter().flat_map(|shape| (0..4).map(move |side| (shape[side], shape[(side + 1) % 4])));
    let hits = walls.filter_map(|(from, to)| {
        let (from, to) = (Point::new(from.0, from.1), Point::new(to.0, to.1));
        let along = to - from;
        let (share, distance) =
            (cross(&from, &beam) / cross(&beam, &along), cross(&from, &along) / cross(&beam, &along));
        ((0.0..=1.0).contains(&share) && distance > 0.0).then_some(distance)
    });
    hits.fold(f64::INFINITY, f64::min)
}

/// Finds the keypoints and compares them with the corners.
pub fn main() {
    let step = TAU / BEAMS as f64;
    let ranges: Vec<f32> = (0..BEAMS).map(|beam| range(beam as f64 * step - PI) as f32).collect();
    let scan = Scan {
        laser: LaserId::FIRST,
        start: Time::default(),
        beam_interval: 0.0,
        first_bearing: -PI,
        bearing_step: step,
        ranges: &ranges,
        intensities: &[],
    };
    let mut points = PointScan::<BEAMS>::new();
    points.set(&scan, 0.5, 30.0);
    let mut detector = falko::Detector::<BEAMS>::new(falko::Parameters::default());
    let mut keypoints = heapless::Vec::<Keypoint, 64>::new();
    detector.detect(&points, &mut keypoints);
    for keypoint in &keypoints {
        let deviation = keypoint.covariance[0].max(keypoint.covariance[2]).sqrt();
        println!(
            "{:?} at ({:.3}, {:.3}) m, {:.1} mm",
            keypoint.kind,
            keypoint.position.x,
            keypoint.position.y,
            1e3 * deviation
        );
    }
    // Nothing is found where nothing is; of the corners of the room most are.
    let distance =
        |(x, y): (f64, f64), one: &Keypoint| (f64::from(one.position.x) - x).hypot(f64::from(one.position.y) - y);
    let is_near = |corner, one: &Keypoint| distance(corner, one) < 0.02;
    assert!(keypoints.iter().all(|one| CORNERS.iter().chain(&PILLAR).any(|corner| is_near(*corner, one))));
    let found = CORNERS.iter().filter(|corner| keypoints.iter().any(|one| is_near(**corner, one))).count();
    assert!(found >= 3, "{found} of 4 corners are found");
}

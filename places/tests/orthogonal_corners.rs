//! Orthogonal corners in rooms whose corners are known.
#![allow(clippy::expect_used, clippy::unwrap_used, reason = "a panic is how a test fails")]

use agv_core::geometry::{Point, Pose, difference};
use agv_core::measurement::{LaserId, Scan, Time};
use agv_core::sensing::{Keypoint, PointScan};
use agv_places::{HoughSpectrum, OrthogonalCorners};
use proptest::prelude::*;

const BEAMS: usize = 720;

/// A scan of a room of 8 x 5 m, seen from `sensor` in its own frame, whose first corner is the origin.
fn room(sensor: &Pose) -> PointScan<BEAMS> {
    let step = std::f64::consts::TAU / BEAMS as f64;
    let ranges: Vec<f32> = (0..BEAMS)
        .map(|beam| {
            let (sine, cosine) = (sensor.theta + step * beam as f64).sin_cos();
            let along = |position: f64, size: f64, direction: f64| {
                if direction > 0.0 { (size - position) / direction } else { -position / direction }
            };
            along(sensor.x, 8.0, cosine).min(along(sensor.y, 5.0, sine)) as f32
        })
        .collect();
    let scan = Scan {
        laser: LaserId::FIRST,
        start: Time::default(),
        beam_interval: 0.0,
        first_bearing: 0.0,
        bearing_step: step,
        ranges: &ranges,
        intensities: &[],
    };
    let mut points = PointScan::new();
    points.set(&scan, 0.02, 30.0);
    points
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn all_corners_of_a_room_are_found_from_anywhere(
        x in 1.5_f64..6.5, y in 1.5_f64..3.5, theta in -3.1_f64..3.1,
    ) {
        let sensor = Pose::new(x, y, theta);
        let scan = room(&sensor);
        let direction = HoughSpectrum::default().dominant_direction(&scan).unwrap();
        // The walls of the room, turned as the sensor is, are the axes.
        let quarter = std::f64::consts::FRAC_PI_2;
        let off = (f64::from(direction) + theta).rem_euclid(quarter);
        prop_assert!(off.min(quarter - off) < 0.01, "{off}");
        let mut found = heapless::Vec::<Keypoint, 16>::new();
        prop_assert_eq!(OrthogonalCorners::default().detect(&scan, &mut found), 0);
        let corners = [(0.0, 0.0, 45_f64), (8.0, 0.0, 135.0), (8.0, 5.0, -135.0), (0.0, 5.0, -45.0)];
        // Runs do not cross the seam of the scan: a corner next to it may be missing.
        prop_assert!(found.len() >= 3 && found.len() <= 4, "{}", found.len());
        for keypoint in &found {
            let position = sensor.transform(&keypoint.position.cast());
            let (x, y, facing) = corners
                .into_iter()
                .min_by(|a, b| {
                    let apart = |c: &(f64, f64, f64)| (Point::new(c.0, c.1) - position).norm();
                    apart(a).total_cmp(&apart(b))
                })
                .unwrap();
            prop_assert!((Point::new(x, y) - position).norm() < 0.05, "{position}");
            let orientation = f64::from(keypoint.orientation) + theta;
            prop_assert!(difference(orientation, facing.to_radians()).abs() < 0.02);
        }
    }
}

#[test]
fn a_scan_of_nothing_has_no_direction() {
    let mut points = PointScan::<BEAMS>::new();
    let scan = Scan {
        laser: LaserId::FIRST,
        start: Time::default(),
        beam_interval: 0.0,
        first_bearing: 0.0,
        bearing_step: 0.01,
        ranges: &[f32::NAN; 10],
        intensities: &[],
    };
    points.set(&scan, 0.02, 30.0);
    assert_eq!(HoughSpectrum::default().dominant_direction(&points), None);
    let mut found = heapless::Vec::<Keypoint, 4>::new();
    assert_eq!(OrthogonalCorners::default().detect(&points, &mut found), 0);
    assert!(found.is_empty());
}

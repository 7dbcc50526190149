//! How keypoints and their descriptors are measured.

use agv_core::geometry::Point;
use agv_core::measurement::{LaserId, Time};
use agv_host_sim::recording::RecordedScan;
use agv_lab::evaluate::features::{Comparison, Disturbance, curve, stability};

#[test]
fn the_curve_counts_what_a_threshold_lets_through() {
    let compare = |distance, is_same| Comparison { distance, is_same };
    let mut comparisons = [compare(3.0, true), compare(1.0, true), compare(2.0, false), compare(2.0, true)];
    let points = curve(&mut comparisons);
    let expected = [(1.0, 1.0, 1.0 / 3.0), (2.0, 2.0 / 3.0, 2.0 / 3.0), (3.0, 0.75, 1.0)];
    for (point, (threshold, precision, recall)) in points.iter().zip(expected) {
        assert_eq!((point.threshold, point.precision, point.recall), (threshold, precision, recall));
    }
    assert_eq!(points.len(), 3);
}

fn wall() -> RecordedScan {
    // Beams at 0, 10, 20 degrees onto the wall x = 2.
    let step = 10_f64.to_radians();
    RecordedScan {
        laser: LaserId::FIRST,
        start: Time::default(),
        beam_interval: 0.0,
        first_bearing: 0.0,
        bearing_step: step,
        ranges: (0..3).map(|beam| (2.0 / (step * f64::from(beam)).cos()) as f32).collect(),
        intensities: Vec::new(),
    }
}

#[test]
fn further_beams_meet_the_same_wall() {
    let scan = Disturbance::Oversampling(3).of(&wall(), 0);
    assert_eq!(scan.ranges.len(), 9);
    for (beam, range) in scan.ranges.iter().enumerate() {
        let x = f64::from(*range) * (scan.bearing_step * beam as f64).cos();
        assert!((x - 2.0).abs() < 1e-5, "{x}");
    }
}

#[test]
fn taking_out_what_was_put_in_gives_the_scan() {
    let there = Disturbance::Oversampling(2).of(&wall(), 0);
    let back = Disturbance::Subsampling(2).of(&there, 0);
    assert_eq!(back.ranges, wall().ranges);
    assert!((back.bearing_step - wall().bearing_step).abs() < 1e-12);
}

#[test]
fn a_landmark_scatters_as_its_keypoints_do() {
    // Four keypoints at +-3 cm and +-1 cm from the first one's place, and one far away.
    let offsets = [(0.0, 0.0), (0.03, 0.0), (-0.03, 0.0), (0.0, 0.01), (0.0, -0.01)];
    let mut scans: Vec<Vec<Point>> = offsets.iter().map(|&(x, y)| vec![Point::new(1.0 + x, 2.0 + y)]).collect();
    scans.push(vec![Point::new(5.0, 5.0), Point::new(5.1, 5.0)]);
    let found = stability(&scans, 0.05);
    assert_eq!((found.landmarks, found.single_share), (2, 0.5));
    // Sample variances: 2 * 0.03^2 / 4 and 2 * 0.01^2 / 4.
    assert!((found.lambda_max_m - 0.03 / 2_f64.sqrt()).abs() < 1e-12);
    assert!((found.lambda_mean_m - (0.03 * 0.01 / 2.0_f64).sqrt()).abs() < 1e-12);
}

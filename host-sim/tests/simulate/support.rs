//! Geometry of a test's own, and access to recordings.

use agv_core::geometry::{Point, Pose};
use agv_core::measurement::{EncoderSample, ReflectorObservation, Time};
use agv_host_sim::recording::{RecordedEvent, RecordedScan, Recording, Truth};
use agv_host_sim::simulate::path::{Direction, Leg, PathSegment};
use agv_host_sim::simulate::scenario::{PathKind, PathOptions, PoseOptions, Scenario, Shapes, WorldOptions};
use agv_host_sim::simulate::shape::Segment;

/// Distance at which a ray crosses a segment, found in the frame of the ray; None if it passes beside it.
pub fn crossing(origin: &Point, angle: f64, segment: &Segment) -> Option<f64> {
    let ray = Pose::new(origin.x, origin.y, angle);
    let (a, b) = (ray.inverse_transform(&segment.from), ray.inverse_transform(&segment.to));
    if (a.y > 0.0) == (b.y > 0.0) {
        return None;
    }
    let along = (a.x * b.y - b.x * a.y) / (b.y - a.y);
    (along > 0.0).then_some(along)
}

pub fn distance_to_segment(point: &Point, segment: &Segment) -> f64 {
    let edge = segment.to - segment.from;
    let share = ((point - segment.from).dot(&edge) / edge.norm_squared()).clamp(0.0, 1.0);
    (segment.from + edge * share - point).norm()
}

/// The pose between two samples of the truth, at constant velocity.
pub fn true_pose(truth: &[Truth], time: Time) -> Pose {
    let index = truth.partition_point(|sample| sample.time <= time).clamp(1, truth.len() - 1) - 1;
    let (before, after) = (&truth[index], &truth[index + 1]);
    let share = time.since(before.time) / after.time.since(before.time);
    before.pose.compose(&before.pose.between(&after.pose).fraction(share))
}

pub fn first_and_last(truth: &[Truth]) -> (Pose, Pose) {
    (truth.first().unwrap().pose, truth.last().unwrap().pose)
}

pub fn scans(recording: &Recording) -> impl Iterator<Item = &RecordedScan> {
    recording.events.iter().filter_map(|event| match event {
        RecordedEvent::Scan(scan) => Some(scan),
        _ => None,
    })
}

pub fn revolutions(recording: &Recording) -> impl Iterator<Item = &Vec<ReflectorObservation>> {
    recording.events.iter().filter_map(|event| match event {
        RecordedEvent::Reflectors(seen) => Some(&seen.observations),
        _ => None,
    })
}

pub fn encoder_samples(recording: &Recording) -> Vec<EncoderSample> {
    let sample = |event: &RecordedEvent| match event {
        RecordedEvent::Encoders(sample) => Some(*sample),
        _ => None,
    };
    recording.events.iter().filter_map(sample).collect()
}

pub fn mean_square(values: &[f64]) -> f64 {
    values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64
}

/// Asserts that `values` have a mean square of one, to four standard deviations of the estimate.
pub fn assert_unit_mean_square(values: &[f64], what: &str) {
    let band = 4.0 * (2.0 / values.len() as f64).sqrt();
    let ratio = mean_square(values);
    assert!((ratio - 1.0).abs() < band, "{what}: {ratio} is not within {band} of 1");
}

/// Left, low, right and high wall of the empty hall, m.
const HALL: (f64, f64, f64, f64) = (-9.0, -7.0, 12.0, 11.0);

/// An empty hall, and a drive through a left and a right bend.
pub fn hall_scenario() -> Scenario {
    let (left, low, right, high) = HALL;
    Scenario {
        seed: 7,
        world: WorldOptions::Shapes(Shapes { walls: Shapes::hall([left, low], [right, high]), ..Shapes::default() }),
        path: PathOptions {
            kind: PathKind::Legs,
            start: PoseOptions { x: -3.0, y: -2.0, heading_deg: 20.0 },
            legs: vec![Leg {
                direction: Direction::Forward,
                segments: vec![PathSegment::arc(2.5, 1.2), PathSegment::arc(3.0, -1.5)],
            }],
        },
        ..Scenario::default()
    }
}

/// Distance from a sensor inside the empty hall to its wall, m.
pub fn range_to_hall(sensor: &Pose, bearing: f64) -> f64 {
    let (left, low, right, high) = HALL;
    let (sine, cosine) = (sensor.theta + bearing).sin_cos();
    let along_x = if cosine > 0.0 { (right - sensor.x) / cosine } else { (left - sensor.x) / cosine };
    let along_y = if sine > 0.0 { (high - sensor.y) / sine } else { (low - sensor.y) / sine };
    along_x.min(along_y)
}

//! Where the localiser said that the vehicle was, and how far off that is, over the way.

use agv_core::geometry::difference;
use agv_core::localizer::{Mode, PoseOutput};
use agv_core::measurement::Time;
use serde::Serialize;

use crate::accuracy::{pose_at, pose_error};
use crate::odometry_steps::odometry_steps;
use crate::recording::Recording;
use crate::replay::Replay;

/// What the poses are compared with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Standard {
    /// The true pose of R.
    Truth,
    /// The pose of S as another instrument has measured it.
    References,
}

/// A pose and where on the way it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackPoint {
    /// Way of R since the first event, by odometry, m.
    pub way: f64,
    /// The pose.
    pub output: PoseOutput,
}

impl TrackPoint {
    /// Standard deviation of the position along the axis on which it is largest, m.
    #[must_use]
    pub fn position_deviation(&self) -> f64 {
        let [xx, xy, yy, ..] = self.output.covariance;
        (0.5 * (xx + yy) + (0.5 * (xx - yy)).hypot(xy)).max(0.0).sqrt()
    }

    /// Standard deviation of the heading, rad.
    #[must_use]
    pub fn heading_deviation(&self) -> f64 {
        self.output.covariance[5].max(0.0).sqrt()
    }
}

/// Error of one pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackError {
    /// When.
    pub time: Time,
    /// Way since the first event, m.
    pub way: f64,
    /// Distance from the standard's position, m.
    pub position: f64,
    /// Heading minus the standard's, rad; None if that knows no heading.
    pub heading: Option<f64>,
    /// Error squared, normalised by the stated covariance, three degrees of freedom; None for references, whose own
    /// error is not known, and for singular covariances.
    pub normalised_square: Option<f64>,
}

/// A replayed drive over its way.
#[derive(Clone, Debug)]
pub struct Track {
    /// The last pose of each instant since a pose was first given.
    pub points: Vec<TrackPoint>,
    /// Length of the way, m.
    pub way: f64,
    /// What the errors are measured against; None if the recording has neither truth nor references.
    pub standard: Option<Standard>,
    /// Errors: of each point if there is truth, else of each reference.
    pub errors: Vec<TrackError>,
}

impl Track {
    /// The track of a replayed recording.
    #[must_use]
    pub fn new(recording: &Recording, replay: &Replay) -> Self {
        let mut points: Vec<TrackPoint> = Vec::new();
        let mut way = 0.0;
        let mut steps = way_steps(recording);
        for output in &replay.poses {
            way += steps.next().unwrap_or_default();
            if output.mode == Mode::NotLocalised {
                continue;
            }
            let point = TrackPoint { way, output: *output };
            match points.last_mut().filter(|last| last.output.time == output.time) {
                Some(last) => *last = point,
                None => points.push(point),
            }
        }
        let (standard, errors) = if !recording.truth.is_empty() {
            (Some(Standard::Truth), errors_of_truth(recording, &points))
        } else if !recording.references.is_empty() {
            (Some(Standard::References), errors_of_references(recording, &points))
        } else {
            (None, Vec::new())
        };
        Self { points, way, standard, errors }
    }

    /// The way at a time, m; at the nearer end outside of the track.
    #[must_use]
    pub fn way_at(&self, time: Time) -> f64 {
        way_at(&self.points, time)
    }
}

fn way_at(points: &[TrackPoint], time: Time) -> f64 {
    let after = points.partition_point(|point| point.output.time < time).min(points.len().saturating_sub(1));
    points.get(after).map_or(0.0, |point| point.way)
}

/// How far R moves with each event, by its odometry, m: the chord, as the motion's own distance is that of the driving wheel.
pub fn way_steps(recording: &Recording) -> impl Iterator<Item = f64> + '_ {
    odometry_steps(recording).map(|step| step.map_or(0.0, |displacement| displacement.position().norm()))
}

fn errors_of_truth(recording: &Recording, points: &[TrackPoint]) -> Vec<TrackError> {
    let error = |point: &TrackPoint| {
        let error = pose_error(&point.output, &recording.truth)?;
        Some(TrackError {
            time: error.time,
            way: point.way,
            position: error.position,
            heading: Some(error.heading),
            normalised_square: error.normalised_square,
        })
    };
    points.iter().filter_map(error).collect()
}

fn errors_of_references(recording: &Recording, points: &[TrackPoint]) -> Vec<TrackError> {
    let outputs: Vec<PoseOutput> = points.iter().map(|point| point.output).collect();
    let errors = recording.references.iter().filter_map(|reference| {
        let laser = pose_at(&outputs, reference.time)?.compose(recording.parameters.lasers.first());
        Some(TrackError {
            time: reference.time,
            way: way_at(points, reference.time),
            position: (laser.position() - reference.position()).norm(),
            heading: reference.heading.map(|heading| difference(laser.theta, heading)),
            normalised_square: None,
        })
    });
    errors.collect()
}

//! The way that the vehicle is meant to drive.

use agv_core::geometry::{Pose, Twist};
use serde::{Deserialize, Serialize};

/// Sense of travel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Direction {
    /// The driving wheel goes first.
    #[default]
    Forward,
    /// The forks go first.
    Backward,
}

impl Direction {
    /// One forward, minus one backward.
    #[must_use]
    pub fn sign(self) -> f64 {
        match self {
            Self::Forward => 1.0,
            Self::Backward => -1.0,
        }
    }
}

/// A straight line or an arc of the logical point.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PathSegment {
    /// Length, m, positive.
    pub length: f64,
    /// Change of heading for each metre forward, rad/m, positive to the left whatever the sense of travel.
    #[serde(default)]
    pub curvature: f64,
}

impl PathSegment {
    /// A straight line of `length` (m).
    #[must_use]
    pub fn straight(length: f64) -> Self {
        Self { length, curvature: 0.0 }
    }

    /// An arc of `radius` (m, positive) through `angle` (rad), with the steering to the left if `angle` is positive.
    #[must_use]
    pub fn arc(radius: f64, angle: f64) -> Self {
        Self { length: radius * angle.abs(), curvature: angle.signum() / radius }
    }
}

/// A part of the path in one sense of travel.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Leg {
    /// Sense of travel.
    #[serde(default)]
    pub direction: Direction,
    /// Lines and arcs in order of travel.
    pub segments: Vec<PathSegment>,
}

impl Leg {
    /// Length, m.
    #[must_use]
    pub fn length(&self) -> f64 {
        self.segments.iter().map(|segment| segment.length).sum()
    }

    /// Where the leg leads from `start`, after `way` (m, from 0 to the leg's length).
    #[must_use]
    pub fn pose(&self, start: &Pose, way: f64) -> Pose {
        let mut pose = *start;
        let mut rest = way;
        for segment in &self.segments {
            let signed = self.direction.sign() * rest.min(segment.length);
            pose = pose.compose(&Pose::exp(&Twist { x: signed, y: 0.0, theta: signed * segment.curvature }));
            rest -= segment.length;
            if rest <= 0.0 {
                break;
            }
        }
        pose
    }

    /// Mean curvature, rad/m, over `window` (m) around `way` (m). Beyond its ends the leg is taken to keep its first and
    /// its last curvature.
    #[must_use]
    pub fn mean_curvature(&self, way: f64, window: f64) -> f64 {
        let (low, high) = (way - 0.5 * window, way + 0.5 * window);
        let last = self.segments.len().saturating_sub(1);
        let mut start = 0.0;
        let mut sum = 0.0;
        for (index, segment) in self.segments.iter().enumerate() {
            let from = if index == 0 { f64::NEG_INFINITY } else { start };
            start += segment.length;
            let to = if index == last { f64::INFINITY } else { start };
            sum += segment.curvature * (to.min(high) - from.max(low)).max(0.0);
        }
        sum / window
    }
}

/// Legs, one after the other.
#[derive(Clone, Debug, PartialEq)]
pub struct Path {
    /// Pose of R in W at the start.
    pub start: Pose,
    /// The legs; each starts where the one before ends.
    pub legs: Vec<Leg>,
}

impl Path {
    /// Length, m.
    #[must_use]
    pub fn length(&self) -> f64 {
        self.legs.iter().map(Leg::length).sum()
    }

    /// Pose of R in W at the end.
    #[must_use]
    pub fn end(&self) -> Pose {
        self.legs.iter().fold(self.start, |pose, leg| leg.pose(&pose, leg.length()))
    }
}

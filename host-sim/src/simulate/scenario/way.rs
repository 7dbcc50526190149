//! The way of a drive.

use agv_core::geometry::Pose;
use serde::{Deserialize, Serialize};

use crate::simulate::path::Leg;

/// The way.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PathOptions {
    /// Which way.
    pub kind: PathKind,
    /// Where it starts, for a way of legs.
    pub start: PoseOptions,
    /// The legs, for a way of legs.
    pub legs: Vec<Leg>,
}

/// Which way.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PathKind {
    /// The block storage's first path.
    P1,
    /// The block storage's second path.
    P2,
    /// The block storage's third path.
    P3,
    /// The block storage's fourth path.
    P4,
    /// The block storage's drive for mapping.
    Mapping,
    /// The warehouse hall's loop.
    HallLoop,
    /// The legs that the scenario states.
    Legs,
}

impl Default for PathOptions {
    fn default() -> Self {
        Self { kind: PathKind::P1, start: PoseOptions::default(), legs: Vec::new() }
    }
}

/// A pose.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PoseOptions {
    /// Position, m.
    pub x: f64,
    /// Position, m.
    pub y: f64,
    /// Heading.
    pub heading_deg: f64,
}

impl PoseOptions {
    /// The pose.
    #[must_use]
    pub fn pose(&self) -> Pose {
        Pose::new(self.x, self.y, self.heading_deg.to_radians())
    }
}

//! Stands for the solver where it was left out.

use agv_core::geometry::Pose;

use super::{Edge, PoseGraphError};
use crate::left_out::POSE_GRAPHS;

pub(super) fn settle(_: &[Pose], _: &[Edge], _: f64) -> Result<Vec<Pose>, PoseGraphError> {
    Err(POSE_GRAPHS.into())
}

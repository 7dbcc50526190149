//! Poses that agree best with what is known of pairs of them.

use agv_core::geometry::Pose;
use factrs::core::{BetweenResidual, GemanMcClure, Graph, LevenMarquardt, PriorResidual, SE2, Values};
use factrs::fac;
use factrs::noise::GaussianNoise;
use factrs::optimizers::OptError;
use factrs::traits::Optimizer;
use nalgebra::Matrix3;

mod symbol {
    #![allow(missing_docs, reason = "the macro documents nothing")]
    use factrs::assign_symbols;
    use factrs::core::SE2;

    assign_symbols!(X: SE2);
}
use symbol::X;

/// What is known of two poses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Edge {
    /// Number of the pose in whose frame the displacement is given.
    pub from: usize,
    /// Number of the other pose.
    pub to: usize,
    /// Pose of `to` in the frame of `from`.
    pub displacement: Pose,
    /// Inverse of its covariance: x, y in the frame of `to` (m), heading (rad).
    pub information: Matrix3<f64>,
    /// Whether it may be wrong altogether.
    pub is_doubtful: bool,
}

impl Edge {
    /// What remains of the edge at these poses: the displacement that the edge would have to be corrected by.
    #[must_use]
    pub fn error(&self, poses: &[Pose]) -> Pose {
        self.displacement.between(&poses[self.from].between(&poses[self.to]))
    }
}

/// Why poses cannot be found.
#[derive(Debug, thiserror::Error)]
pub enum PoseGraphError {
    /// The solver gave up.
    #[error("the pose graph cannot be solved: {0}")]
    Unsolvable(String),
    /// What is known of an edge is no information.
    #[error("the information of the edge from {0} to {1} is not positive definite")]
    NotDefinite(usize, usize),
}

/// Deviation of the first pose, which is held, m and rad.
const HELD: f64 = 1e-3;

/// Error of a doubtful edge, in standard deviations, at which it loses most of its weight: from one that leaves all edges
/// theirs to the last.
const DOUBT: [f64; 6] = [1000.0, 300.0, 100.0, 30.0, 10.0, 4.0];

/// Moves poses to where they agree best with the edges; the first one stays. Edges that may be wrong lose their weight
/// where they disagree (Geman and McClure's loss), little at first and more as the poses settle: no start is needed that
/// is near the solution.
///
/// # Errors
/// See [`PoseGraphError`].
pub fn optimise(poses: &[Pose], edges: &[Edge]) -> Result<Vec<Pose>, PoseGraphError> {
    let is_doubtful = edges.iter().any(|edge| edge.is_doubtful);
    let rounds = if is_doubtful { DOUBT.as_slice() } else { &DOUBT[..1] };
    rounds.iter().try_fold(poses.to_vec(), |poses, &doubt| settle(&poses, edges, doubt))
}

/// Solves the graph with one loss for the edges that may be wrong.
fn settle(poses: &[Pose], edges: &[Edge], doubt: f64) -> Result<Vec<Pose>, PoseGraphError> {
    let mut values = Values::new();
    for (number, pose) in (0..).zip(poses) {
        values.insert(X(number), SE2::new(pose.theta, pose.x, pose.y));
    }
    let mut graph = Graph::new();
    if let Some(first) = poses.first() {
        let held = GaussianNoise::<3>::from_scalar_sigma(HELD);
        graph.add_factor(fac![PriorResidual::new(SE2::new(first.theta, first.x, first.y)), X(0), held]);
    }
    for edge in edges {
        let displacement = &edge.displacement;
        let residual = BetweenResidual::new(SE2::new(displacement.theta, displacement.x, displacement.y));
        let i = &edge.information;
        // The solver's tangent space has the heading first.
        let information = factrs::linalg::Matrix3::new(i.m33, i.m13, i.m23, i.m13, i.m11, i.m12, i.m23, i.m12, i.m22);
        let noise = GaussianNoise::<3>::from_matrix_inf(information.as_view())
            .ok_or(PoseGraphError::NotDefinite(edge.from, edge.to))?;
        let keys = (X(edge.from as u32), X(edge.to as u32));
        if edge.is_doubtful {
            graph.add_factor(fac![residual, (keys.0, keys.1), noise, GemanMcClure::new(doubt)]);
        } else {
            graph.add_factor(fac![residual, (keys.0, keys.1), noise]);
        }
    }
    let mut optimizer: LevenMarquardt = LevenMarquardt::new_default(graph);
    let found = match optimizer.optimize(values) {
        // What has been reached is no worse than the start.
        Ok(found) | Err(OptError::MaxIterations(found)) => found,
        // Nothing is better than the start.
        Err(OptError::FailedToStep) => return Ok(poses.to_vec()),
        Err(problem) => return Err(PoseGraphError::Unsolvable(format!("{problem:?}"))),
    };
    let pose = |number: usize| {
        let found = found.get(X(number as u32))?;
        Some(Pose::new(found.x(), found.y(), found.theta()))
    };
    (0..poses.len())
        .map(|number| pose(number).ok_or_else(|| PoseGraphError::Unsolvable("a pose is missing".to_owned())))
        .collect()
}

//! Poses that agree best with what is known of pairs of them.

#[cfg(not(feature = "pose-graphs"))]
#[path = "no_solver.rs"]
mod solver;
#[cfg(feature = "pose-graphs")]
mod solver;

use agv_core::geometry::Pose;
use nalgebra::Matrix3;

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
    /// This program was built without the solver.
    #[error(transparent)]
    LeftOut(#[from] crate::left_out::LeftOut),
    /// What is known of an edge is no information.
    #[error("the information of the edge from {0} to {1} is not positive definite")]
    NotDefinite(usize, usize),
}

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
    rounds.iter().try_fold(poses.to_vec(), |poses, &doubt| solver::settle(&poses, edges, doubt))
}

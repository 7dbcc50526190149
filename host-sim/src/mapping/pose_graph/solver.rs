//! One solution of a pose graph, by Levenberg and Marquardt.

use agv_core::geometry::Pose;
use factrs::core::{BetweenResidual, GemanMcClure, Graph, LevenMarquardt, PriorResidual, SE2, Values};
use factrs::fac;
use factrs::noise::GaussianNoise;
use factrs::optimizers::OptError;
use factrs::traits::Optimizer;

use super::{Edge, PoseGraphError};

mod symbol {
    #![allow(missing_docs, reason = "the macro documents nothing")]
    use factrs::assign_symbols;
    use factrs::core::SE2;

    assign_symbols!(X: SE2);
}
use symbol::X;

/// Deviation of the first pose, which is held, m and rad.
const HELD: f64 = 1e-3;

/// Solves the graph with one loss for the edges that may be wrong.
pub(super) fn settle(poses: &[Pose], edges: &[Edge], doubt: f64) -> Result<Vec<Pose>, PoseGraphError> {
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

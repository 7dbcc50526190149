//! How a sensor has moved between two revolutions: upright surfaces are laid over each other, point to line.

use agv_core::geometry::Pose;
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use nalgebra::{Matrix3, Rotation2, Vector2, Vector3};

use super::wall_points::WallPoint;

/// Surfaces of different heights are farther apart than they seem from above: the height counts as this share of itself.
const HEIGHT_SHARE: f64 = 0.5;
/// Points are compared with the nearest one up to this distance, m, if both face alike by this cosine.
const REACH: f64 = 1.0;
const ALIKE: f64 = 0.94;
/// How far from its line a point counts: so many robust deviations, and at least this, m.
const DEVIATIONS: f64 = 3.5 * 1.4826;
const NARROWEST: f64 = 1e-4;
/// A point lies on its surface if it is this near, m.
const AGREEING: f64 = 0.05;
/// Steps at the most, and when there is nothing to gain any more, m and rad.
const STEPS: usize = 40;
const SMALL: f64 = 1e-8;
/// Fewest points.
const LEAST_POINTS: usize = 80;
/// Share of the points that face most nearly along the direction that is known least.
const LEAST_SHARE: f64 = 0.004;

/// What an alignment found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aligned {
    /// Pose of the sensor in the revolution that was compared with.
    pub pose: Pose,
    /// Points that lie on their surface.
    pub agreeing: usize,
}

/// A revolution that others are compared with.
pub struct Target {
    points: Vec<WallPoint>,
    tree: ImmutableKdTree<f64, 3>,
}

impl Target {
    /// None if there are too few points.
    #[must_use]
    pub fn new(points: Vec<WallPoint>) -> Option<Self> {
        let places: Vec<[f64; 3]> = points.iter().map(place).collect();
        let tree = ImmutableKdTree::new_from_slice(&places).ok()?;
        (points.len() >= LEAST_POINTS).then_some(Self { points, tree })
    }

    /// The pose of the sensor of other points in this revolution, near to `start`: points count that lie at most `gate` from their
    /// surface there, m. None if the surfaces do not tell.
    #[must_use]
    pub fn align(&self, others: &[WallPoint], start: &Pose, gate: f64) -> Option<Aligned> {
        let mut pose = *start;
        let mut gate = gate;
        for _ in 0..STEPS {
            let mut pairs = self.pairs(others, &pose);
            pairs.retain(|(_, residual)| residual.abs() <= gate);
            if pairs.len() < LEAST_POINTS {
                return None;
            }
            let step = step(&pairs)?;
            pose = Pose::new(pose.x + step.x, pose.y + step.y, pose.theta + step.z);
            let mut residuals: Vec<f64> = pairs.iter().map(|(_, residual)| residual.abs()).collect();
            let middle = residuals.len() / 2;
            let median = *residuals.select_nth_unstable_by(middle, f64::total_cmp).1;
            let next = (DEVIATIONS * median).clamp(NARROWEST, gate);
            if step.amax() < SMALL && next > 0.99 * gate {
                break;
            }
            gate = next;
        }
        let agreeing = self.pairs(others, &pose).iter().filter(|(_, residual)| residual.abs() < AGREEING).count();
        Some(Aligned { pose, agreeing })
    }

    /// Of each point that lies near a surface, the row of its equation and how far off it is, m.
    fn pairs(&self, others: &[WallPoint], pose: &Pose) -> Vec<(Vector3<f64>, f64)> {
        let (turn, shift) = (Rotation2::new(pose.theta), Vector2::new(pose.x, pose.y));
        let pair = |other: &WallPoint| {
            let arm = turn * other.position.coords;
            let (position, normal) = (arm + shift, turn * other.normal);
            let asked = [position.x, position.y, HEIGHT_SHARE * other.height];
            let nearest = self.tree.query(&asked).nearest_one::<SquaredEuclidean<f64>>().execute();
            let surface = &self.points[nearest.item as usize];
            if nearest.distance > REACH * REACH || surface.normal.dot(&normal) < ALIKE {
                return None;
            }
            let across = surface.normal;
            let row = Vector3::new(across.x, across.y, across.y * arm.x - across.x * arm.y);
            Some((row, across.dot(&(position - surface.position.coords))))
        };
        others.iter().filter_map(pair).collect()
    }
}

fn place(point: &WallPoint) -> [f64; 3] {
    [point.position.x, point.position.y, HEIGHT_SHARE * point.height]
}

/// The step of least squares; None if no surfaces face along one direction.
fn step(pairs: &[(Vector3<f64>, f64)]) -> Option<Vector3<f64>> {
    let (mut information, mut sum) = (Matrix3::zeros(), Vector3::zeros());
    for (row, residual) in pairs {
        information += row * row.transpose();
        sum -= row * *residual;
    }
    let position = information.fixed_view::<2, 2>(0, 0).into_owned();
    let is_known = position.symmetric_eigenvalues().min() > LEAST_SHARE * pairs.len() as f64;
    information.cholesky().filter(|_| is_known).map(|parts| parts.solve(&sum))
}

//! Landmark stability: how much the keypoints of one point of the world scatter over a whole drive (K 3.3.1, table 3.1).

use std::collections::HashMap;

use agv_core::geometry::Point;
use nalgebra::Matrix2;
use serde::Serialize;

/// A keypoint further than this from all landmarks becomes one, m (K 3.3.1: d_min).
const NEW: f64 = 0.2;

/// One row of table 3.1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Stability {
    /// A keypoint nearer than this to a landmark belongs to it, m (d_max).
    pub association_m: f64,
    /// Number of landmarks.
    pub landmarks: usize,
    /// Share of the landmarks that were seen once.
    pub single_share: f64,
    /// Mean over the others of the geometric mean of both standard deviations along the axes of the scatter, m.
    pub lambda_mean_m: f64,
    /// Mean over the others of the larger of both, m.
    pub lambda_max_m: f64,
}

/// Builds landmarks of keypoints in the world, scan by scan.
#[must_use]
pub fn stability(scans: &[Vec<Point>], association_m: f64) -> Stability {
    let mut cells: HashMap<(i64, i64), Vec<usize>> = HashMap::new();
    let mut landmarks: Vec<Vec<Point>> = Vec::new();
    for point in scans.iter().flatten() {
        let cell = ((point.x / NEW).floor() as i64, (point.y / NEW).floor() as i64);
        let around = (-1..=1).flat_map(|i| (-1..=1).map(move |j| (cell.0 + i, cell.1 + j)));
        let known = around.filter_map(|cell| cells.get(&cell)).flatten();
        let nearest =
            known.map(|&number| ((landmarks[number][0] - point).norm(), number)).min_by(|a, b| a.0.total_cmp(&b.0));
        match nearest {
            Some((distance, number)) if distance < association_m => landmarks[number].push(*point),
            Some((distance, _)) if distance < NEW => {}
            _ => {
                cells.entry(cell).or_default().push(landmarks.len());
                landmarks.push(vec![*point]);
            }
        }
    }
    let scatters: Vec<_> = landmarks.iter().filter_map(|points| scatter(points)).collect();
    let share = 1.0 / scatters.len().max(1) as f64;
    Stability {
        association_m,
        landmarks: landmarks.len(),
        single_share: (landmarks.len() - scatters.len()) as f64 / landmarks.len().max(1) as f64,
        lambda_mean_m: scatters.iter().map(|(small, large)| (small * large).sqrt()).sum::<f64>() * share,
        lambda_max_m: scatters.iter().map(|(_, large)| large).sum::<f64>() * share,
    }
}

/// Standard deviations along the axes of the scatter, the smaller first. None for one point.
fn scatter(points: &[Point]) -> Option<(f64, f64)> {
    if points.len() < 2 {
        return None;
    }
    let mean = points.iter().sum::<Point>() / points.len() as f64;
    let covariance: Matrix2<f64> =
        points.iter().map(|point| (point - mean) * (point - mean).transpose()).sum::<Matrix2<f64>>()
            / (points.len() - 1) as f64;
    let values = covariance.symmetric_eigenvalues();
    let root = |value: f64| value.max(0.0).sqrt();
    Some((root(values.min()), root(values.max())))
}

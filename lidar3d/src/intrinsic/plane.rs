//! The plane of a scan.

use nalgebra::{Matrix3, Vector3};

/// A plane: the points p with `normal . p = distance`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Unit vector.
    pub normal: Vector3<f64>,
    /// m.
    pub distance: f64,
}

impl Plane {
    /// Signed distance of a point, m.
    #[must_use]
    pub fn residual(&self, point: Vector3<f64>) -> f64 {
        self.normal.dot(&point) - self.distance
    }
}

/// The plane with the least sum of squared distances (M 3.7). None for fewer than three points.
#[must_use]
pub fn fit(points: impl Iterator<Item = [f64; 3]> + Clone) -> Option<Plane> {
    let (count, sum) =
        points.clone().fold((0usize, Vector3::zeros()), |(count, sum), p| (count + 1, sum + Vector3::from(p)));
    if count < 3 {
        return None;
    }
    let mean = sum / count as f64;
    let scatter = points.fold(Matrix3::zeros(), |scatter: Matrix3<f64>, point| {
        let from_mean = Vector3::from(point) - mean;
        scatter + from_mean * from_mean.transpose()
    });
    let eigen = scatter.symmetric_eigen();
    let normal = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
    Some(Plane { normal, distance: normal.dot(&mean) })
}

//! A plane, and its fit to points.

use nalgebra::{Matrix3, Vector3};

/// The points p with `normal` · p = `distance`, in the frame of the sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Of length 1.
    pub normal: [f64; 3],
    /// From the origin along the normal, m.
    pub distance: f64,
}

impl Plane {
    /// Signed distance of a point, m.
    #[must_use]
    pub fn distance_of(&self, point: [f64; 3]) -> f64 {
        let [a, b, c] = self.normal;
        a * point[0] + b * point[1] + c * point[2] - self.distance
    }

    /// Through three points; None if they lie nearly on a line.
    pub(super) fn through(points: [[f64; 3]; 3]) -> Option<Self> {
        let [first, second, third] = points.map(Vector3::from);
        let normal = (second - first).cross(&(third - first)).try_normalize(1e-3)?;
        Some(Self { normal: normal.into(), distance: normal.dot(&first) })
    }

    /// The plane with the least sum of squared distances, by principal components (M 3.2.3); None for fewer than three
    /// points.
    #[must_use]
    pub fn fit(points: impl Iterator<Item = [f64; 3]> + Clone) -> Option<Self> {
        let (count, sum) = points
            .clone()
            .fold((0_usize, Vector3::zeros()), |(count, sum), point| (count + 1, sum + Vector3::from(point)));
        if count < 3 {
            return None;
        }
        let mean = sum / count as f64;
        let scatter = points.fold(Matrix3::zeros(), |scatter, point| {
            let from_mean = Vector3::from(point) - mean;
            scatter + from_mean * from_mean.transpose()
        });
        let eigen = scatter.symmetric_eigen();
        let normal: Vector3<f64> = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
        Some(Self { normal: normal.into(), distance: normal.dot(&mean) })
    }

    /// Two directions in the plane, at right angles to each other.
    pub(super) fn directions(&self) -> [Vector3<f64>; 2] {
        let normal = Vector3::from(self.normal);
        let mut axis = Vector3::zeros();
        axis[normal.iamin()] = 1.0;
        let first = normal.cross(&axis).normalize();
        [first, normal.cross(&first)]
    }

    /// Turned by small angles towards [`Self::directions`], rad, and moved along its normal, m.
    pub(super) fn moved(&self, [first, second, along]: [f64; 3]) -> Self {
        let [a, b] = self.directions();
        let normal = (Vector3::from(self.normal) + a * first + b * second).normalize();
        Self { normal: normal.into(), distance: self.distance + along }
    }
}

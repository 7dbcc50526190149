//! A pose by the surfaces of a kept map, as an aid of the filter.

use nalgebra::{Matrix3, Vector3};

use super::Aid;
use crate::contours::ContourMatch;
use crate::filter::{Ekf, Linearisation, Slots};
use crate::geometry::{Pose, difference};
use crate::measurement::Time;

/// By what the covariance of a match is multiplied that takes points as independent.
const INFLATION: f64 = 3.0;

/// Standard deviation that is added along each axis for what all scans of a map have in common, m.
const POSITION_FLOOR: f64 = 0.005;

/// The same for the heading, rad.
const HEADING_FLOOR: f64 = 1e-3;

/// Standard deviation along a free axis, m: as good as nothing.
const FREE: f64 = 100.0;

/// Chi-square with three degrees of freedom, 99.9 per cent.
const GATE: f64 = 16.3;

/// If this share of a scan's points lies on surfaces, it is believed however surprising it is: the search has looked no further
/// than the odometry may be wrong.
const SURE_SHARE: f32 = 0.5;

/// Where R is by a match of a scan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContourFix {
    time: Time,
    pose: Pose,
    covariance: Matrix3<f64>,
    is_sure: bool,
}

impl ContourFix {
    /// What a match says that was true at `time`, of a laser mounted at `mount` in R. None if its information is no matrix of one.
    #[must_use]
    pub fn new(time: Time, found: &ContourMatch, mount: &Pose) -> Option<Self> {
        let free = Matrix3::from_diagonal_element(1.0 / (FREE * FREE));
        let floor = Vector3::new(
            POSITION_FLOOR * POSITION_FLOOR,
            POSITION_FLOOR * POSITION_FLOOR,
            HEADING_FLOOR * HEADING_FLOOR,
        );
        let covariance = (found.information / INFLATION + free).try_inverse()? + Matrix3::from_diagonal(&floor);
        let back = mount.inverse();
        // Position and heading of the laser are those of R with the lever between them.
        let jacobian = found.pose.compose_jacobian_first(&back);
        Some(Self {
            time,
            pose: found.pose.compose(&back),
            covariance: jacobian * covariance * jacobian.transpose(),
            is_sure: found.share >= SURE_SHARE,
        })
    }
}

impl Aid<3> for ContourFix {
    fn time(&self) -> Time {
        self.time
    }

    fn linearise<S: Slots>(&self, state: &Ekf<S>) -> Option<Linearisation<3>> {
        let residual = Vector3::new(
            self.pose.x - state.pose.x,
            self.pose.y - state.pose.y,
            difference(self.pose.theta, state.pose.theta),
        );
        Some(
            Linearisation::new(residual, self.covariance)
                .with(0, Vector3::x())
                .with(1, Vector3::y())
                .with(2, Vector3::z()),
        )
    }

    fn gate(&self) -> f64 {
        if self.is_sure { f64::MAX } else { GATE }
    }
}

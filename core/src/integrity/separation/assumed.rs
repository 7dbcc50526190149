//! What is assumed to be unknown of a vehicle in order, and how often something is wrong.

use serde::{Deserialize, Serialize};

use super::sensor_information::not_negative;
use crate::geometry::larger_axis;
use crate::state::ProtectionLevel;

/// Standard deviations of what stays as it is for the whole drive, beside the noise of the odometry and of the sensors. They
/// are what calibration and clocks leave; each has the source that its default is from.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AssumedDeviations {
    /// Place of the laser in R along each axis, m. Calibration by a drive leaves 0.3 mm.
    pub mounting: f64,
    /// Yaw of the laser in R, rad. Calibration by a drive leaves 0.011 deg.
    pub mounting_yaw: f64,
    /// Clock of the laser against that of the odometry, s. The laser's time stamps have a resolution of 1 ms.
    pub clock: f64,
    /// Scale of the distance travelled, share. Wear, load and pressure of a tyre.
    pub scale: f64,
    /// Steering angle, rad; of a vehicle without a steered wheel the turn that it does not report, rad/m.
    pub steering: f64,
    /// Turn against the reported one, share: error of the wheelbase or of the track.
    pub turn: f64,
}

impl Default for AssumedDeviations {
    /// 1 mm, 0.02 deg, 2 ms, 0.2 %, 0.05 deg, 0.3 %.
    fn default() -> Self {
        Self { mounting: 1e-3, mounting_yaw: 3.5e-4, clock: 2e-3, scale: 2e-3, steering: 8.7e-4, turn: 3e-3 }
    }
}

/// Deviations of the fault-free bounds. Half of the risk of an hour, 5e-8, is that of a vehicle in order, shared by position
/// and heading; a pose is judged at each of 28,800 revolutions. `exp(-k^2 / 2) = 2.5e-8 / 28,800` in the plane, and the same
/// on either side of one axis.
pub const FAULT_FREE: Factors = Factors { position: 7.45, heading: 7.15 };

/// Deviations of the bound of a solution that holds if one assumption is wrong. The other half of the risk is shared by the
/// assumptions that may fail, 1e-4 an hour together, each of which is looked at 60 times: 2.1e-6.
pub const ONE_FAULT: Factors = Factors { position: 5.1, heading: 4.8 };

/// The same of a knock, which is over in an interval: the error of the solution that allows for it is that of the interval until a few
/// metres have shown it, so it is looked at 4 times: 3.1e-5.
pub const ONE_KNOCK: Factors = Factors { position: 4.56, heading: 4.17 };

/// Deviations of the bound of a solution that holds if what hardly ever happens has happened, 2e-8 times an hour: a laser that turns by
/// itself, and fast, while the vehicle drives. It is looked at as often as the others, and may take as much of the risk: 2.1e-2.
pub const ONE_RARE_FAULT: Factors = Factors { position: 2.8, heading: 2.3 };

/// How many deviations a bound has.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Factors {
    /// Of the larger axis of the position.
    pub position: f64,
    /// Of the heading.
    pub heading: f64,
}

impl Factors {
    /// So many times as large.
    #[must_use]
    pub fn times(&self, share: f64) -> Self {
        Self { position: share * self.position, heading: share * self.heading }
    }
}

/// The protection level of a pose with this covariance in W (xx, xy, yy, x heading, y heading, heading; m and rad), if nothing is wrong
/// with vehicle, sensors and map, and if these have no errors that last.
#[must_use]
pub fn fault_free(covariance: &[f64; 6]) -> ProtectionLevel {
    let [xx, xy, yy, _, _, heading] = *covariance;
    ProtectionLevel {
        position: FAULT_FREE.position * libm::sqrt(not_negative(larger_axis(xx, xy, yy))),
        heading: FAULT_FREE.heading * libm::sqrt(not_negative(heading)),
    }
}

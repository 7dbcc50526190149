//! How wrong the vehicle's own account may be.

use nalgebra::{Matrix2, Matrix3};
use serde::{Deserialize, Serialize};

use super::Control;

/// Distance of the wheels of a vehicle that integrates its motion itself, m: that of a vehicle as wide as a pallet.
const UNKNOWN_TRACK: f64 = 0.8;

/// Noise of the odometry. Noise of the controls enters through their Jacobian, unlike K 5.3, where it is added to the
/// state; the other terms are the floor for what the model of the vehicle does not know.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct OdometryNoise {
    /// Standard deviation of the speed of the wheel, independent from sample to sample, m/s.
    pub speed: f64,
    /// Standard deviation of the steering angle, independent from sample to sample, rad.
    pub steering: f64,
    /// Random walk of the distance travelled by the wheel (slip), m for a square root of a metre.
    pub slip: f64,
    /// Random walk across the direction of travel, m for a square root of a metre.
    pub side_slip: f64,
    /// Random walk of the heading, rad for a square root of a metre.
    pub yaw: f64,
    /// Random walk of the heading for a turn, on the spot too, rad for a square root of a radian.
    pub turn: f64,
    /// Standard deviation of the acceleration of a vehicle whose odometry is not believed, m/s^2.
    pub unknown_acceleration: f64,
    /// Standard deviation of the angular acceleration of such a vehicle, rad/s^2.
    pub unknown_turn: f64,
}

impl Default for OdometryNoise {
    /// A vehicle that was calibrated with some care.
    fn default() -> Self {
        Self {
            speed: 0.0,
            steering: 2e-4,
            slip: 6e-3,
            side_slip: 1e-3,
            yaw: 1.5e-3,
            turn: 0.0,
            unknown_acceleration: 1.0,
            unknown_turn: 0.5,
        }
    }
}

impl OdometryNoise {
    /// Covariance of the displacement that `control` makes in `duration` seconds, in R at the start.
    #[must_use]
    pub fn of_control(&self, control: &Control, wheelbase: f64, duration: f64) -> Matrix3<f64> {
        let speed = self.speed * duration;
        let controls = Matrix2::new(
            speed * speed + self.slip * self.slip * libm::fabs(control.distance),
            0.0,
            0.0,
            self.steering * self.steering,
        );
        let jacobian = control.jacobian(wheelbase);
        let angle = 0.5 * (control.steering_start + control.steering_end);
        let turn = if self.turn > 0.0 { control.distance / wheelbase * libm::sin(angle) } else { 0.0 };
        jacobian * controls * jacobian.transpose() + self.floor(libm::fabs(control.distance), turn)
    }

    /// Covariance of a displacement of that length, m, and turn, rad, that the vehicle has integrated itself.
    ///
    /// Its wheels are not known. Two that stand [`UNKNOWN_TRACK`] apart roll half of it for each radian on the spot, and their slip
    /// has the variance `2 slip^2 (track / 2) / track^2` for each radian.
    #[must_use]
    pub fn of_displacement(&self, distance: f64, turn: f64, duration: f64) -> Matrix3<f64> {
        let speed = self.speed * duration;
        let mut covariance = self.floor(distance, turn);
        covariance.m11 += speed * speed + self.slip * self.slip * distance;
        covariance.m33 += self.slip * self.slip / UNKNOWN_TRACK * libm::fabs(turn);
        covariance
    }

    /// Variance of the heading behind so many m and rad, beside that of the wheels, rad^2.
    pub(super) fn of_heading(&self, distance: f64, turn: f64) -> f64 {
        self.yaw * self.yaw * distance + self.turn * self.turn * libm::fabs(turn)
    }

    fn floor(&self, distance: f64, turn: f64) -> Matrix3<f64> {
        let side_slip = self.side_slip * self.side_slip * distance;
        Matrix3::from_diagonal(&nalgebra::Vector3::new(0.0, side_slip, self.of_heading(distance, turn)))
    }
}

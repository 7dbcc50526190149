//! What is believed of a rate gyro.

use serde::{Deserialize, Serialize};

/// What is believed of a rate gyro whose axis points up.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GyroParameters {
    /// Whether the vehicle has one.
    pub is_fitted: bool,
    /// True rate over the told one; negative if it counts clockwise.
    pub factor: f64,
    /// From when a rate is true to when it is heard, s.
    pub latency: f64,
    /// Noise density of the rate, rad/s for a root of a hertz: the walk of the angle, rad for a root of a second.
    pub noise: f64,
    /// Standard deviation of the bias when it is switched on, rad/s.
    pub bias: f64,
    /// Walk of the bias, rad/s for a root of a second.
    pub drift: f64,
    /// Standard deviation of the scale, as a share.
    pub scale: f64,
    /// The largest rate that it can tell, rad/s.
    pub range: f64,
}

impl Default for GyroParameters {
    /// A micromechanical gyro of the usual grade, of which data sheets say: 0.005 deg/s/sqrt(Hz), which is 0.05 deg/s rms a
    /// sample at 100 Hz; 0.5 deg/s after switching on; a drift of 10 deg/h in a minute; 0.3 % of scale; 250 deg/s of range.
    fn default() -> Self {
        Self {
            is_fitted: false,
            factor: 1.0,
            latency: 0.0,
            noise: 8.7e-5,
            bias: 8.7e-3,
            drift: 6.3e-6,
            scale: 3e-3,
            range: 4.36,
        }
    }
}

/// Lasting errors of a gyro: the true rate is the told one without the bias, and that share more.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct GyroErrors {
    /// What it tells of a vehicle that stands, rad/s.
    pub bias: f64,
    /// True rate over the told one, minus one.
    pub scale: f64,
}

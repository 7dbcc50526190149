//! The gyro.

use serde::{Deserialize, Serialize};

/// The gyro. The believed one is of the usual grade, with the latency and the range of the true one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GyroOptions {
    /// Whether the vehicle has one.
    pub fitted: bool,
    /// Readings a second.
    pub rate: f64,
    /// Noise of a reading, deg/s.
    pub noise_deg: f64,
    /// Standard deviation of the bias at the start, deg/s.
    pub bias_deg: f64,
    /// Standard deviation of what the bias walks in a minute, deg/h.
    pub drift_deg_h: f64,
    /// True rate over the told one, minus one; the seed chooses the sign.
    pub scale_error: f64,
    /// From the end of a reading to when it is heard, s.
    pub latency: f64,
    /// Largest rate that it tells, deg/s.
    pub range_deg: f64,
    /// Step of what it tells, deg/s.
    pub step_deg: f64,
    /// What goes wrong with it.
    pub faults: Vec<GyroFault>,
}

impl Default for GyroOptions {
    fn default() -> Self {
        Self {
            fitted: false,
            rate: 100.0,
            noise_deg: 0.05,
            bias_deg: 0.2,
            drift_deg_h: 10.0,
            scale_error: 0.002,
            latency: 0.002,
            range_deg: 250.0,
            step_deg: 0.01,
            faults: Vec::new(),
        }
    }
}

impl GyroOptions {
    /// From the middle of the time of a reading to when it is heard, s.
    #[must_use]
    pub fn middle_latency(&self) -> f64 {
        self.latency + 0.5 / self.rate
    }
}

/// What goes wrong with a gyro for some time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GyroFault {
    /// When it begins, s after the drive's first event.
    pub from: f64,
    /// How long it lasts, s.
    pub lasts: f64,
    /// Whether the gyro tells the same rate all the time.
    #[serde(default)]
    pub frozen: bool,
    /// Whether it tells nothing.
    #[serde(default)]
    pub silent: bool,
    /// By how much its bias is another one, deg/s.
    #[serde(default)]
    pub jump_deg: f64,
}

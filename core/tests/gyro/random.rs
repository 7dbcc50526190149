//! A gyro of the usual grade, and its noise.

use agv_core::odometry::GyroParameters;

/// Numbers of a normal distribution, by the sum of twelve even ones.
pub struct Random(pub u64);

impl Random {
    pub fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}

pub const FITTED: GyroParameters = GyroParameters {
    is_fitted: true,
    factor: 1.0,
    latency: 0.0,
    noise: 8.7e-5,
    bias: 8.7e-3,
    drift: 6.3e-6,
    scale: 3e-3,
    range: 4.36,
};

//! How the sensor's head lies in the frame S, and how it turns.

use core::f64::consts::PI;

use agv_core::geometry::{Pose, wrap};

use super::PoseReport;

/// Facts about the head. This is the one place where the sensor's axes become those of S, whose first axis points to
/// the front of the housing and whose angles are counter-clockwise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorFrame {
    /// Direction of the sensor's zero in S, rad. The default is the rear of the housing, as was seen with real sensors.
    pub zero: f64,
    /// Whether the sensor's angles grow clockwise, seen from above. The default is no, which is not verified.
    pub is_clockwise: bool,
    /// Time of one revolution, s. The default is that of the data sheet.
    pub period: f64,
}

impl Default for SensorFrame {
    fn default() -> Self {
        // Minus pi, not plus: the directions of a revolution then lie between the two.
        Self { zero: -PI, is_clockwise: false, period: 0.125 }
    }
}

impl SensorFrame {
    fn sign(&self) -> f64 {
        if self.is_clockwise { -1.0 } else { 1.0 }
    }

    /// Direction in S, rad, not wrapped, of the sensor's direction `angle`, rad.
    #[must_use]
    pub fn bearing(&self, angle: f64) -> f64 {
        self.zero + self.sign() * angle
    }

    /// The sensor's direction, rad, not wrapped, of the direction `bearing` in S, rad.
    #[must_use]
    pub fn angle(&self, bearing: f64) -> f64 {
        self.sign() * (bearing - self.zero)
    }

    /// Angle between beams in S, rad, of beams that are `step` rad apart.
    #[must_use]
    pub fn step(&self, step: f64) -> f64 {
        self.sign() * step
    }

    /// Time between beams that are `step` rad apart, s.
    #[must_use]
    pub fn interval(&self, step: f64) -> f64 {
        self.period * step / (2.0 * PI)
    }

    /// A speed along the axes of S and its rotation, in the sensor's axes.
    #[must_use]
    pub fn speed(&self, [x, y, rotation]: [f64; 3]) -> [f64; 3] {
        let (sine, cosine) = libm::sincos(self.zero);
        [x * cosine + y * sine, self.sign() * (y * cosine - x * sine), self.sign() * rotation]
    }

    /// Pose of S in the sensor's layout. Only the heading is turned: the position is not one of the sensor's frame.
    #[must_use]
    pub fn pose(&self, report: &PoseReport) -> Pose {
        let heading = report.heading.radians() - self.sign() * self.zero;
        Pose { x: report.x.metres(), y: report.y.metres(), theta: wrap(heading) }
    }
}

//! Planar transforms of scan points.

use super::{Pose, ScanPoint};

/// A planar rotation and shift in single precision.
#[derive(Clone, Copy, Debug)]
pub struct Transform {
    sine: f32,
    cosine: f32,
    shift: ScanPoint,
}

impl Transform {
    /// That of a body at a pose.
    #[must_use]
    pub fn of(pose: &Pose) -> Self {
        let (sine, cosine) = libm::sincos(pose.theta);
        Self { sine: sine as f32, cosine: cosine as f32, shift: ScanPoint::new(pose.x as f32, pose.y as f32) }
    }

    /// The transform that fits one pair of points to another best. None for points that coincide.
    #[must_use]
    pub fn between(from: (ScanPoint, ScanPoint), to: (ScanPoint, ScanPoint)) -> Option<Self> {
        let (a, b) = (from.1 - from.0, to.1 - to.0);
        let (dot, cross) = (a.dot(&b), a.x * b.y - a.y * b.x);
        let strength = libm::sqrtf(dot * dot + cross * cross);
        if strength.is_nan() || strength <= 1e-6 {
            return None;
        }
        let mut transform = Self { sine: cross / strength, cosine: dot / strength, shift: ScanPoint::zeros() };
        // The middles of the pairs meet.
        transform.shift = (to.0 + to.1) * 0.5 - transform.apply(&((from.0 + from.1) * 0.5));
        Some(transform)
    }

    /// The pose of the source frame in the target frame.
    #[must_use]
    pub fn pose(&self) -> Pose {
        let theta = libm::atan2(f64::from(self.sine), f64::from(self.cosine));
        Pose::new(f64::from(self.shift.x), f64::from(self.shift.y), theta)
    }

    /// Position of the source frame in the target frame, m.
    #[must_use]
    pub fn shift(&self) -> ScanPoint {
        self.shift
    }

    /// A point of the source frame in the target frame, m.
    #[inline]
    #[must_use]
    pub fn apply(&self, point: &ScanPoint) -> ScanPoint {
        ScanPoint::new(
            self.shift.x + self.cosine * point.x - self.sine * point.y,
            self.shift.y + self.sine * point.x + self.cosine * point.y,
        )
    }
}

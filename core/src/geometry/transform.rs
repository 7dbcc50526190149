//! Planar transforms of scan points.

use core::ops::{Add, Mul, Sub};

use nalgebra::{Scalar, Vector2};

use super::{Point, Pose, ScanPoint};

/// A planar rotation and shift, for scan points in single precision.
#[derive(Clone, Copy, Debug)]
pub struct Transform<T = f32> {
    sine: T,
    cosine: T,
    shift: Vector2<T>,
}

impl<T: Scalar + Copy + Add<Output = T> + Sub<Output = T> + Mul<Output = T>> Transform<T> {
    /// Position of the source frame in the target frame, m.
    #[must_use]
    pub fn shift(&self) -> Vector2<T> {
        self.shift
    }

    /// A point of the source frame in the target frame, m.
    #[inline]
    #[must_use]
    pub fn apply(&self, point: &Vector2<T>) -> Vector2<T> {
        Vector2::new(
            self.shift.x + self.cosine * point.x - self.sine * point.y,
            self.shift.y + self.sine * point.x + self.cosine * point.y,
        )
    }
}

impl Transform<f64> {
    /// That of a body that stands where its frame is.
    pub(crate) const IDENTITY: Self = Self { sine: 0.0, cosine: 1.0, shift: Point::new(0.0, 0.0) };

    /// That of a body at a pose, in double precision.
    pub(crate) fn exact(pose: &Pose) -> Self {
        let (sine, cosine) = libm::sincos(pose.theta);
        Self { sine, cosine, shift: pose.position() }
    }

    /// The share `share` of the way to another one, each number by itself: for turns that are small.
    #[inline]
    pub(crate) fn towards(&self, other: &Self, share: f64) -> Self {
        let between = |from: f64, to: f64| from + share * (to - from);
        Self {
            sine: between(self.sine, other.sine),
            cosine: between(self.cosine, other.cosine),
            shift: Point::new(between(self.shift.x, other.shift.x), between(self.shift.y, other.shift.y)),
        }
    }

    /// A point of the target frame in the source frame, m.
    pub(crate) fn apply_inverse(&self, point: &Point) -> Point {
        let (dx, dy) = (point.x - self.shift.x, point.y - self.shift.y);
        Point::new(self.cosine * dx + self.sine * dy, self.cosine * dy - self.sine * dx)
    }

    /// The pose of the source frame in the target frame.
    pub(crate) fn exact_pose(&self) -> Pose {
        Pose::new(self.shift.x, self.shift.y, libm::atan2(self.sine, self.cosine))
    }

    /// The same in single precision.
    #[inline]
    pub(crate) fn single(&self) -> Transform {
        Transform { sine: self.sine as f32, cosine: self.cosine as f32, shift: self.shift.map(|axis| axis as f32) }
    }
}

impl Transform {
    /// That of a body at a pose.
    #[must_use]
    pub fn of(pose: &Pose) -> Self {
        Transform::exact(pose).single()
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
}

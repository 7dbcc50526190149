//! Pairs of keypoints of two scans.

use super::{Alignment, align};
use crate::features::Keypoint;
use crate::geometry::{Pose, ScanPoint};

/// A keypoint of one scan and one of another that may be the same point of the world.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Correspondence {
    /// Index of the keypoint of the source scan.
    pub source: u8,
    /// Index of the keypoint of the target scan.
    pub target: u8,
}

/// A planar rotation and shift in single precision.
#[derive(Clone, Copy, Debug)]
pub(super) struct Transform {
    sine: f32,
    cosine: f32,
    shift: ScanPoint,
}

impl Transform {
    pub(super) fn of(pose: &Pose) -> Self {
        let (sine, cosine) = libm::sincos(pose.theta);
        Self { sine: sine as f32, cosine: cosine as f32, shift: ScanPoint::new(pose.x as f32, pose.y as f32) }
    }

    /// The transform that fits one pair of points to another best. None for points that coincide.
    pub(super) fn between(from: (ScanPoint, ScanPoint), to: (ScanPoint, ScanPoint)) -> Option<Self> {
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
    pub(super) fn pose(&self) -> Pose {
        let theta = libm::atan2(f64::from(self.sine), f64::from(self.cosine));
        Pose::new(f64::from(self.shift.x), f64::from(self.shift.y), theta)
    }

    /// Position of the source frame in the target frame, m.
    pub(super) fn shift(&self) -> ScanPoint {
        self.shift
    }

    #[inline]
    pub(super) fn apply(&self, point: &ScanPoint) -> ScanPoint {
        ScanPoint::new(
            self.shift.x + self.cosine * point.x - self.sine * point.y,
            self.shift.y + self.sine * point.x + self.cosine * point.y,
        )
    }
}

/// The keypoint of `target` of the same kind that is nearest to `position` (m, target's frame), and the squared
/// distance; none beyond `radius`.
pub(super) fn nearest(
    keypoint: &Keypoint,
    position: ScanPoint,
    target: &[Keypoint],
    radius: f32,
) -> Option<(usize, f32)> {
    let mut best = (usize::MAX, radius * radius);
    for (index, other) in target.iter().enumerate() {
        let square = (other.position - position).norm_squared();
        if square < best.1 && other.kind == keypoint.kind {
            best = (index, square);
        }
    }
    (best.0 != usize::MAX).then_some(best)
}

/// How many keypoints of the source have one of the target within `radius` (m), if the source scan was taken at `pose`
/// in the frame of the target (K 4.2.1 counts so).
#[must_use]
pub fn common_points(source: &[Keypoint], target: &[Keypoint], pose: &Pose, radius: f32) -> usize {
    let transform = Transform::of(pose);
    source
        .iter()
        .filter(|keypoint| nearest(keypoint, transform.apply(&keypoint.position), target, radius).is_some())
        .count()
}

/// Fits the pose anew to the pairs of keypoints that lie within `radius` (m) of each other at `pose`. None for fewer than
/// two pairs.
#[must_use]
pub fn refine(source: &[Keypoint], target: &[Keypoint], pose: &Pose, radius: f32) -> Option<Alignment> {
    let transform = Transform::of(pose);
    let pairs = source.iter().filter_map(move |keypoint| {
        let (index, _) = nearest(keypoint, transform.apply(&keypoint.position), target, radius)?;
        Some((keypoint.position.cast(), target.get(index)?.position.cast(), 1.0))
    });
    if pairs.clone().take(2).count() < 2 {
        return None;
    }
    align(pairs)
}

/// Fits a pose to correspondences.
pub(super) fn align_correspondences(
    source: &[Keypoint],
    target: &[Keypoint],
    pairs: impl Iterator<Item = Correspondence> + Clone,
) -> Option<Alignment> {
    let points = pairs.filter_map(|pair| {
        let from = source.get(usize::from(pair.source))?.position.cast();
        Some((from, target.get(usize::from(pair.target))?.position.cast(), 1.0))
    });
    align(points)
}

//! Pairs of keypoints of two scans.

use agv_core::geometry::{Pose, RigidFit, ScanPoint, Transform, fit_rigid};
use agv_core::sensing::Keypoint;

/// A keypoint of one scan and one of another that may be the same point of the world.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Correspondence {
    /// Index of the keypoint of the source scan.
    pub source: u8,
    /// Index of the keypoint of the target scan.
    pub target: u8,
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
pub fn refine(source: &[Keypoint], target: &[Keypoint], pose: &Pose, radius: f32) -> Option<RigidFit> {
    let transform = Transform::of(pose);
    let pairs = source.iter().filter_map(move |keypoint| {
        let (index, _) = nearest(keypoint, transform.apply(&keypoint.position), target, radius)?;
        Some((keypoint.position.cast(), target.get(index)?.position.cast(), 1.0))
    });
    if pairs.clone().take(2).count() < 2 {
        return None;
    }
    fit_rigid(pairs)
}

/// Fits a pose to correspondences.
pub(super) fn align_correspondences(
    source: &[Keypoint],
    target: &[Keypoint],
    pairs: impl Iterator<Item = Correspondence> + Clone,
) -> Option<RigidFit> {
    let points = pairs.filter_map(|pair| {
        let from = source.get(usize::from(pair.source))?.position.cast();
        Some((from, target.get(usize::from(pair.target))?.position.cast(), 1.0))
    });
    fit_rigid(points)
}

//! A distinctive point of a scan.

use core::cmp::Ordering;

use heapless::Vec;

use crate::geometry::ScanPoint;

/// What kind of shape a keypoint marks; only keypoints of one kind are compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum KeypointKind {
    /// Where two edges meet.
    Corner,
    /// Where a face that stands in front of something ends.
    EndPoint,
}

/// A distinctive point of a scan, in the frame in which the scan's points are given.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Keypoint {
    /// Shape that the point marks.
    pub kind: KeypointKind,
    /// Index of the beam at which it was found.
    pub beam: u16,
    /// Position, m.
    pub position: ScanPoint,
    /// Covariance of the position: xx, xy, yy, m^2.
    pub covariance: [f32; 3],
    /// Direction of the corner (K 3.2.3), rad, in the frame of the position.
    pub orientation: f32,
    /// Radius of the neighbourhood in which it was found, m.
    pub radius: f32,
    /// What the detector held against it; smaller is better. Cornerness (K 3.10), or the largest variance of the position,
    /// m^2, of corners that a gate has passed; zero for ends of faces.
    pub score: f32,
}

impl Keypoint {
    /// Compares how badly the positions are known, and where they are known alike, what the detector held against them.
    fn weakness(&self, other: &Self) -> Ordering {
        let variance = |keypoint: &Self| {
            let [xx, _, yy] = keypoint.covariance;
            xx + yy
        };
        variance(self).total_cmp(&variance(other)).then(self.score.total_cmp(&other.score))
    }
}

/// Keeps a keypoint, if there is no more room in place of the one whose position is known worst. True if one is left out.
pub(super) fn keep_best<const N: usize>(keypoints: &mut Vec<Keypoint, N>, keypoint: Keypoint) -> bool {
    let Err(keypoint) = keypoints.push(keypoint) else { return false };
    let worst = keypoints.iter_mut().max_by(|a, b| a.weakness(b));
    if let Some(worst) = worst.filter(|worst| keypoint.weakness(worst).is_lt()) {
        *worst = keypoint;
    }
    true
}

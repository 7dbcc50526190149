//! A distinctive point of a scan.

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

//! What a search among reflectors ends in.

use nalgebra::Matrix3;

use crate::geometry::Pose;

/// A pose that explains the reflectors seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReflectorFix {
    /// Pose in W of the frame in which the reflectors were seen.
    pub pose: Pose,
    /// Covariance of `pose` (x, y, theta; m, rad).
    pub covariance: Matrix3<f64>,
    /// Reflectors seen that the map explains.
    pub matched: u8,
    /// Logarithm of the likelihood against none of them being of the map.
    pub log_likelihood: f32,
}

/// The outcome of a search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ReflectorAnswer {
    /// One pose explains what was seen, and no other comes near.
    Found(ReflectorFix),
    /// Two poses fit almost equally.
    Ambiguous(ReflectorFix, ReflectorFix),
    /// Too few reflectors were seen to tell.
    TooFew,
    /// No pose explains half of what was seen.
    Unknown,
}

//! What a vehicle reports of its motion, and what follows from that: one kinematics a file.

use core::fmt::Debug;

use nalgebra::Matrix3;

use super::{Integration, OdometryNoise};
use crate::geometry::Pose;
use crate::measurement::Time;

/// How a vehicle moves between two of its reports.
pub trait Kinematics: Copy + Debug {
    /// What it reports.
    type Report: Copy + Debug;

    /// When a report was true.
    fn time(report: &Self::Report) -> Time;

    /// Whether the vehicle can say that.
    fn is_sound(&self, report: &Self::Report) -> bool;

    /// The step from one report to the next, `duration` seconds later.
    fn step(&self, from: &Self::Report, to: &Self::Report, duration: f64, believed: &Believed) -> Step;

    /// Distance from the axle to the wheel of which [`super::OdometryBias::steering`] is the angle, m; none without such a
    /// wheel. With it, the derivative of a displacement by the biases is [`super::BiasJacobian::of`].
    fn steering_lever(&self) -> Option<f64>;

    /// Longest time between two reports that tell the motion without doubt, s, for a vehicle that is no faster than `fastest`
    /// (m/s).
    fn longest_interval(&self, fastest: f64) -> f64;

    /// Smallest distance that a report can hold beside none, m: the way of a tick, or zero. None if it reports a speed, of which the
    /// time makes no more and no less.
    fn resolution(&self) -> Option<f64>;
}

/// What is believed of a step.
#[derive(Clone, Copy, Debug)]
pub struct Believed {
    /// How wrong it may be.
    pub noise: OdometryNoise,
    /// How it is integrated.
    pub integration: Integration,
    /// Whether the step before went backward: a vehicle that stands has no direction of its own.
    pub was_backward: bool,
}

/// What a vehicle did between two reports.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// Displacement of R, in R at the start.
    pub displacement: Pose,
    /// Its covariance: x, y, heading.
    pub covariance: Matrix3<f64>,
    /// Distance travelled, m, not negative: that of the wheel that drives, or of R.
    pub distance: f64,
    /// Whether it went backward.
    pub is_backward: bool,
    /// What redundant measurements say differently: root of the sum of squares over all wheels, m; negative if the first wheel has
    /// told too little. Zero without redundancy.
    pub slip: f64,
}

impl Step {
    /// A vehicle that stands.
    #[must_use]
    pub fn standing(is_backward: bool) -> Self {
        let (displacement, covariance) = (Pose::default(), Matrix3::zeros());
        Self { displacement, covariance, distance: 0.0, is_backward, slip: 0.0 }
    }
}

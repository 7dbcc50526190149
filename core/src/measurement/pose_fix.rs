//! A pose from outside.

use serde::{Deserialize, Serialize};

use super::Time;
use crate::geometry::Pose;

/// A pose that is given from outside: by an operator, by a start position, or by relocalisation. One that is not sound
/// ([`PoseFix::is_sound`]) is left alone.
///
/// One that was true a moment ago is carried on to now by what the odometry has said since. One that is older than what the
/// localiser remembers, about 0.4 s among landmarks and 1.3 s without, is left alone, too: nobody knows where the vehicle
/// has gone meanwhile, and the pose has to be given again. Before the first pose nothing is remembered, and any time will do.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PoseFix {
    /// When the vehicle was there.
    pub time: Time,
    /// Pose of R in W.
    pub pose: Pose,
    /// Standard deviation of the position along each axis, m.
    pub position_deviation: f64,
    /// Standard deviation of the heading, rad.
    pub heading_deviation: f64,
}

/// Poses further from the origin of W, and deviations larger than this, m, are taken as faults.
const FARTHEST: f64 = 1e6;

impl PoseFix {
    /// Whether the pose can be taken: all numbers are finite and of a possible size, and no deviation is negative.
    #[must_use]
    pub fn is_sound(&self) -> bool {
        self.pose.is_finite()
            && libm::fabs(self.pose.x) <= FARTHEST
            && libm::fabs(self.pose.y) <= FARTHEST
            && libm::fabs(self.pose.theta) <= FARTHEST
            && (0.0..=FARTHEST).contains(&self.position_deviation)
            && (0.0..=FARTHEST).contains(&self.heading_deviation)
    }
}

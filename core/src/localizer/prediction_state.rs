//! What carries a pose on, beside the pose.

use serde::{Deserialize, Serialize};

use crate::odometry::{GyroErrors, OdometryBias};
use crate::state::LevelGrowth;

/// What the localiser has learnt of the motion.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PredictionState {
    /// Lasting errors of the odometry, which are taken from its motions.
    pub bias: OdometryBias,
    /// Errors of the gyro that tells the turns; none if none does.
    pub gyro: Option<GyroErrors>,
    /// How the level grows until landmarks are seen again.
    pub growth: LevelGrowth,
}

impl Default for PredictionState {
    /// Nothing was learnt.
    fn default() -> Self {
        Self { bias: OdometryBias::default(), gyro: None, growth: LevelGrowth::NONE }
    }
}

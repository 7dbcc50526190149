//! What a landmark looks like from the vehicle.

use serde::{Deserialize, Serialize};

use super::viewpoint::{Believed, Model, Viewpoint};
use super::{Cartesian, RangeBearing};
use crate::geometry::{Point, Pose};

/// One landmark, seen from S.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Observation {
    /// Distance and direction (K 5.14).
    RangeBearing(RangeBearing),
    /// Position (K 5.3, last paragraph of the observation model).
    Cartesian(Cartesian),
}

impl Observation {
    /// Where the landmark is in W if the vehicle is at `pose`, m.
    #[must_use]
    pub fn locate(&self, pose: &Pose, mount: &Pose) -> Point {
        pose.compose(mount).transform(&self.position())
    }

    /// Where the landmark is in S, m.
    #[must_use]
    pub fn position(&self) -> Point {
        match self {
            Self::RangeBearing(seen) => {
                let (sine, cosine) = libm::sincos(seen.bearing);
                Point::new(seen.range * cosine, seen.range * sine)
            }
            Self::Cartesian(seen) => seen.position,
        }
    }

    /// The observation as a position.
    #[must_use]
    pub fn cartesian(&self) -> Cartesian {
        match self {
            Self::RangeBearing(seen) => seen.cartesian(),
            Self::Cartesian(seen) => *seen,
        }
    }

    /// Compares the observation with a landmark. None if the landmark is at the sensor.
    pub(super) fn model(&self, from: &Viewpoint, landmark: &Believed) -> Option<Model> {
        match self {
            Self::RangeBearing(seen) => seen.model(from, landmark),
            Self::Cartesian(seen) => Some(seen.model(from, landmark)),
        }
    }
}

//! Distances that are wrong by a rule.

use agv_core::measurement::ReflectorObservation;
use serde::{Deserialize, Serialize};

/// By what a distance is wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RangeError {
    /// By that share of it.
    Stretched,
    /// By so many metres once the laser is warm, a minute after it began; in proportion before.
    Warms,
    /// By so many metres to the left of the laser.
    OneSide,
    /// Short by so many metres at the laser, and by less with the distance: a receiver that is driven too hard by reflectors.
    NearShort,
    /// By so many metres at half of the reflectors: flat ones that are set as round, or the other way.
    OtherShape,
}

/// How long a laser takes to warm up, s.
pub(super) const WARMS: f64 = 60.0;
/// Distance over which a receiver recovers, m.
const RECOVERS: f64 = 4.0;

impl RangeError {
    /// What is added to a distance, m; `grown` is how much of the warming has come, and `is_chosen` whether the reflector is of the half.
    pub(super) fn error(self, size: f64, (range, bearing): (f64, f64), grown: f64, is_chosen: bool) -> f64 {
        match self {
            Self::Stretched => size * range,
            Self::Warms => size * grown,
            Self::OneSide if bearing > 0.0 => size,
            Self::NearShort => -size * libm::exp(-range / RECOVERS),
            Self::OtherShape if is_chosen => size,
            Self::OneSide | Self::OtherShape => 0.0,
        }
    }

    /// Whether surfaces have it too.
    pub(super) const fn is_of_surfaces(self) -> bool {
        !matches!(self, Self::NearShort | Self::OtherShape)
    }

    /// Makes the distance of a reflector wrong.
    pub(super) fn spoil(self, size: f64, seen: &mut ReflectorObservation, grown: f64, is_chosen: bool) {
        let at = (f64::from(seen.range), f64::from(seen.bearing));
        seen.range = (at.0 + self.error(size, at, grown, is_chosen)).max(0.1) as f32;
    }
}

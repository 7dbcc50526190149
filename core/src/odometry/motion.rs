//! A displacement with its uncertainty.

use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};

use crate::geometry::Pose;
use crate::measurement::Time;

/// How R moved in an interval, in R at the start of the interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Motion {
    /// Start of the interval.
    pub start: Time,
    /// End of the interval.
    pub end: Time,
    /// Displacement.
    pub displacement: Pose,
    /// Covariance of the displacement: x, y, heading.
    pub covariance: Matrix3<f64>,
    /// Distance travelled, m, not negative: that of the wheel that drives, or of R for a vehicle that integrates itself.
    pub distance: f64,
}

impl Motion {
    /// A vehicle that stands still at `time`, in an interval of no length.
    #[must_use]
    pub fn none(time: Time) -> Self {
        Self { start: time, end: time, displacement: Pose::default(), covariance: Matrix3::zeros(), distance: 0.0 }
    }

    /// The two parts of the motion before and after `time`, at constant body velocity. A time outside the interval is
    /// taken as its nearer end.
    #[must_use]
    pub fn split(&self, time: Time) -> (Motion, Motion) {
        let duration = self.end.since(self.start);
        let share = if duration > 0.0 { (time.since(self.start) / duration).clamp(0.0, 1.0) } else { 1.0 };
        let time = time.clamp(self.start, self.end.max(self.start));
        let first = self.displacement.fraction(share);
        (
            Motion {
                start: self.start,
                end: time,
                displacement: first,
                covariance: self.covariance * share,
                distance: self.distance * share,
            },
            Motion {
                start: time,
                end: self.end,
                displacement: first.between(&self.displacement),
                covariance: self.covariance * (1.0 - share),
                distance: self.distance * (1.0 - share),
            },
        )
    }

    /// This motion and the one that follows it, as one.
    #[must_use]
    pub fn then(&self, next: &Motion) -> Motion {
        let (by_first, by_second) =
            (self.displacement.compose_jacobian_first(&next.displacement), self.displacement.compose_jacobian_second());
        Motion {
            start: self.start,
            end: next.end,
            displacement: self.displacement.compose(&next.displacement),
            covariance: by_first * self.covariance * by_first.transpose()
                + by_second * next.covariance * by_second.transpose(),
            distance: self.distance + next.distance,
        }
    }

    /// What remains of the motion after `done`, a displacement that was assumed from its start until `time`. The total
    /// displacement is kept exactly.
    #[must_use]
    pub fn remainder(&self, done: &Pose, time: Time) -> Motion {
        let (_, rest) = self.split(time);
        Motion { displacement: done.between(&self.displacement), ..rest }
    }
}

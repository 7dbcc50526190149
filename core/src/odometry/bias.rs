//! What the odometry says wrongly all the time.

use serde::{Deserialize, Serialize};

use super::Motion;
use crate::geometry::Pose;

/// Lasting errors of a vehicle's own account of its motion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct OdometryBias {
    /// True distance over the reported one, minus one.
    pub scale: f64,
    /// True steering angle minus the assumed one, rad; for a vehicle without a steered wheel the turn that it does not
    /// report, rad/m.
    pub steering: f64,
}

/// How a displacement changes with the bias.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BiasJacobian {
    /// By the scale: x and y in m, heading in rad.
    pub scale: [f64; 3],
    /// By the steering angle, for each rad.
    pub steering: [f64; 3],
}

impl BiasJacobian {
    /// That of a displacement which is short against its radius; a steered wheel stands `lever` (m) before the axle, if
    /// there is one. It goes less far along the more it is turned; a turn that is not reported changes no distance.
    #[must_use]
    pub fn of(displacement: &Pose, lever: Option<f64>) -> Self {
        Self::of_length(displacement, lever, displacement.x)
    }

    /// The same of a vehicle that may move sideways: without a lever it turns for each metre of `length`, in the direction of travel.
    ///
    /// The arc of a body velocity `(u, v, w)` ends at `(u - v w / 2, v + u w / 2, w)` up to second order; its derivative by the length of
    /// that velocity is written here in the displacement itself.
    #[must_use]
    pub fn of_length(displacement: &Pose, lever: Option<f64>, length: f64) -> Self {
        let Pose { x, y, theta } = *displacement;
        let half = 0.5 * theta;
        let scale = [x - half * y, y + half * x, theta];
        let steering = match lever {
            Some(lever) => [-lever * theta, 0.5 * x * x / lever, x / lever],
            None => [-0.5 * y * length, 0.5 * x * length, length],
        };
        Self { scale, steering }
    }
}

impl Motion {
    /// The motion without a bias; `lever` as in [`BiasJacobian::of`].
    #[must_use]
    pub fn corrected(&self, bias: &OdometryBias, lever: Option<f64>) -> Motion {
        if *bias == OdometryBias::default() {
            return *self;
        }
        let jacobian = BiasJacobian::of(&self.displacement, lever);
        let [x, y, theta] = [0, 1, 2].map(|axis: usize| {
            let by = |column: &[f64; 3]| column.get(axis).copied().unwrap_or(0.0);
            by(&jacobian.scale) * bias.scale + by(&jacobian.steering) * bias.steering
        });
        let displacement = &self.displacement;
        Motion { displacement: Pose::new(displacement.x + x, displacement.y + y, displacement.theta + theta), ..*self }
    }
}

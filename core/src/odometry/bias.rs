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
        let (turn, along) = match lever {
            Some(lever) => (displacement.x / lever, -lever * displacement.theta),
            None => (displacement.x, 0.0),
        };
        Self {
            scale: [displacement.x, 2.0 * displacement.y, displacement.theta],
            steering: [along, 0.5 * displacement.x * turn, turn],
        }
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

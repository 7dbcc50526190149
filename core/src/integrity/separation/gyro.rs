//! A vehicle whose turns a gyro tells: what lasts of its errors stands in the solutions where those of the wheels' turns did, and one
//! more solution rests on the wheels alone.

use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};

use super::assumed::AssumedDeviations;
use super::solution::{Solution, Step};
use crate::geometry::Pose;
use crate::odometry::{BiasJacobian, GyroParameters, Motion};

/// Errors of wheels that tell a turn because the gyro does not are taken to last for this distance, m.
const LASTING: f64 = 10.0;

/// What the gyro adds to the solutions.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct GyroSeparation {
    /// As for the wheels, but with bias (rad/s) and scale of the gyro for steering and turn.
    assumed: AssumedDeviations,
    drift: f64,
    /// For how long the gyro has told the turn since the solutions went on, s.
    told: f64,
    /// What the wheels alone have told since.
    wheels: (Pose, Matrix3<f64>),
    /// What was told of all motions since.
    by_gyro: Pose,
    /// Covariance of what the wheels tell in a second, as they did before.
    rate: Matrix3<f64>,
    /// The solution that holds if the gyro is wrong.
    alone: Solution,
}

impl GyroSeparation {
    /// Solutions of a vehicle that does not know where it is; `assumed` is of its wheels.
    #[must_use]
    pub fn new(parameters: &GyroParameters, assumed: &AssumedDeviations) -> Self {
        Self {
            assumed: AssumedDeviations { steering: parameters.bias, turn: parameters.scale, ..*assumed },
            drift: parameters.drift * parameters.drift,
            told: 0.0,
            wheels: (Pose::default(), Matrix3::zeros()),
            by_gyro: Pose::default(),
            rate: Matrix3::zeros(),
            alone: Solution::new(Pose::default(), &[0.0; 6], assumed),
        }
    }

    /// What is assumed of all solutions but that of the wheels.
    #[must_use]
    pub const fn assumed(&self) -> &AssumedDeviations {
        &self.assumed
    }

    /// The solution of the wheels.
    #[must_use]
    pub const fn alone(&self) -> &Solution {
        &self.alone
    }

    /// The solution of the wheels.
    pub const fn alone_mut(&mut self) -> &mut Solution {
        &mut self.alone
    }

    /// What the wheels alone have told since the solutions went on: its covariance.
    #[must_use]
    pub const fn wheels_covariance(&self) -> &Matrix3<f64> {
        let (_, covariance) = &self.wheels;
        covariance
    }

    /// What the wheels alone will have told after so many seconds more, s, as they have told before: its covariance.
    #[must_use]
    pub fn wheels_covariance_after(&self, seconds: f64) -> Matrix3<f64> {
        self.wheels_covariance() + self.rate * seconds
    }

    /// The bias is known to so much, rad/s, by what does not rest on landmarks or has been corrected by them.
    pub fn know(&mut self, bias: f64, prior: f64) {
        self.assumed.steering = bias.min(prior);
    }

    /// Begins at a pose.
    pub fn begin(&mut self, pose: &Pose, covariance: &[f64; 6], assumed: &AssumedDeviations) {
        self.alone = Solution::new(*pose, covariance, assumed);
        self.pending_done();
    }

    fn pending_done(&mut self) {
        self.told = 0.0;
        self.wheels = (Pose::default(), Matrix3::zeros());
        self.by_gyro = Pose::default();
    }

    /// Takes a motion, and the same as the wheels tell it if the gyro has told its turn. Returns what the covariance of the heading
    /// lacks for all other solutions, rad^2: that of wheels which are believed instead of the gyro.
    #[must_use]
    pub fn travel(&mut self, motion: &Motion, by_wheels: Option<&Motion>, assumed: &AssumedDeviations) -> f64 {
        let wheels = by_wheels.unwrap_or(motion);
        let (displacement, covariance) = &mut self.wheels;
        *displacement = displacement.compose(&wheels.displacement);
        *covariance += wheels.covariance;
        self.by_gyro = self.by_gyro.compose(&motion.displacement);
        if by_wheels.is_some() {
            self.told += motion.end.since(motion.start);
            return 0.0;
        }
        let by_way = assumed.steering * motion.distance;
        let by_turn = assumed.turn * motion.displacement.theta;
        if motion.distance > 0.0 {
            (by_way * by_way + by_turn * by_turn) * (LASTING / motion.distance).max(1.0)
        } else {
            0.0
        }
    }

    /// How a displacement changes with scale and bias.
    #[must_use]
    pub fn jacobian(&self, displacement: &Pose) -> BiasJacobian {
        let Pose { x, y, .. } = *displacement;
        let told = self.told;
        BiasJacobian { scale: [x, y, 0.0], steering: [0.5 * y * told, -0.5 * x * told, -told] }
    }

    /// Lets the solution of the wheels go on, while the others do by `moved`: what of that no motion has told was extrapolated, and is
    /// in both. A steered wheel has its lever, m, and other vehicles go a length in the direction of travel, m. Returns by how much the bias of all others may have drifted in so many seconds: a
    /// variance.
    #[must_use]
    pub fn step(&mut self, moved: &Pose, (lever, length): (Option<f64>, f64), passed: f64) -> f64 {
        let (displacement, covariance) = self.wheels;
        let displacement = displacement.compose(&self.by_gyro.between(moved));
        if passed > 0.0 {
            self.rate = covariance / passed;
        }
        self.alone.predict(&Step {
            displacement,
            covariance,
            by_bias: BiasJacobian::of_length(&displacement, lever, length),
        });
        self.pending_done();
        self.drift * passed.max(0.0)
    }
}

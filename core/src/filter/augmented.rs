//! The pose together with what it depends on: biases of odometry and laser, past poses, and landmarks found on the way.
//!
//! An extended Kalman filter with all correlations, so that a landmark which was placed with a wrong heading is known to
//! be wrong with it. States have fixed places: the pose, the biases, `KEYS` past poses, `LANDMARKS` landmarks; a place
//! that is free has neither variance nor correlation. The angle of the whole map cannot be observed, and linearisation at
//! ever new estimates would invent knowledge of it; so the Jacobians are those of first estimates (Huang, Mourikis and
//! Roumeliotis, "Observability-based rules for designing consistent EKF SLAM estimators", IJRR 2010).

use nalgebra::{Matrix3, SMatrix, SVector};
use serde::{Deserialize, Serialize};

use super::{Ekf, PackedCovariance, SparseLinearisation};
use crate::geometry::{Point, Pose, wrap};
use crate::odometry::{BiasJacobian, Motion, OdometryBias};

/// First of the states of each kind.
pub(super) const POSE: usize = 0;
pub(super) const SCALE: usize = 3;
const STEERING: usize = 4;
pub(super) const YAW: usize = 5;
const KEYS_FROM: usize = 6;

/// States of a filter with room for that many past poses and landmarks.
#[must_use]
pub const fn augmented_states(keys: usize, landmarks: usize) -> usize {
    KEYS_FROM + 3 * keys + 2 * landmarks
}

/// How wrong a calibration may be: standard deviations.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BiasDeviations {
    /// Of the drive's scale, as a share.
    pub scale: f64,
    /// Of the steering angle, rad; of a vehicle without a steered wheel, rad/m.
    pub steering: f64,
    /// Of the laser's yaw, rad.
    pub laser_yaw: f64,
}

impl Default for BiasDeviations {
    /// Odometry of a vehicle that was calibrated badly; a laser whose yaw was calibrated (STC of K repeats within 1e-4 rad).
    fn default() -> Self {
        Self { scale: 5e-3, steering: 4e-3, laser_yaw: 3e-4 }
    }
}

/// How fast a calibration changes, by load, wear and what is mounted anew: random walks, standard deviations for a square
/// root of a metre.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BiasWalk {
    /// Of the drive's scale, as a share.
    pub scale: f32,
    /// Of the steering angle, rad; of a vehicle without a steered wheel, rad/m.
    pub steering: f32,
    /// Of the laser's yaw, rad.
    pub laser_yaw: f32,
}

impl BiasWalk {
    /// Biases that never change.
    pub const NONE: Self = Self { scale: 0.0, steering: 0.0, laser_yaw: 0.0 };
}

impl Default for BiasWalk {
    /// After one kilometre two thousandths of the scale, as tyres yield to loads, and 0.02 deg of the steering and of the laser,
    /// as bolts and bearings do to wear: what was learnt counts for some hundred metres, and ten metres hardly feel it.
    fn default() -> Self {
        Self { scale: 6e-5, steering: 1e-5, laser_yaw: 1e-5 }
    }
}

/// A pose that was copied when it was the present one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PastPose {
    pub pose: Pose,
    /// Position for the Jacobians, m.
    pub anchor: Point,
}

/// A landmark in the state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct StateLandmark {
    /// Position in W, m.
    pub position: Point,
    /// Position for the Jacobians, m.
    pub anchor: Point,
}

/// The augmented filter; `STATES` is [`augmented_states`] and `ENTRIES` is [`super::packed_entries`] of that.
#[derive(Clone, Debug)]
pub struct Augmented<const KEYS: usize, const LANDMARKS: usize, const STATES: usize, const ENTRIES: usize> {
    pub(super) pose: Pose,
    /// Position of the pose for the Jacobians: as it was predicted, m.
    pub(super) anchor: Point,
    pub(super) bias: OdometryBias,
    pub(super) laser_yaw: f64,
    pub(super) keys: [Option<PastPose>; KEYS],
    pub(super) landmarks: [Option<StateLandmark>; LANDMARKS],
    pub(super) covariance: PackedCovariance<STATES, ENTRIES>,
}

impl<const KEYS: usize, const LANDMARKS: usize, const STATES: usize, const ENTRIES: usize>
    Augmented<KEYS, LANDMARKS, STATES, ENTRIES>
{
    /// A filter that knows its pose, the origin, exactly, and no bias.
    #[must_use]
    #[inline(always)]
    pub const fn new() -> Self {
        const { assert!(STATES == augmented_states(KEYS, LANDMARKS)) }
        Self {
            pose: Pose { x: 0.0, y: 0.0, theta: 0.0 },
            anchor: Point::new(0.0, 0.0),
            bias: OdometryBias { scale: 0.0, steering: 0.0 },
            laser_yaw: 0.0,
            keys: [None; KEYS],
            landmarks: [None; LANDMARKS],
            covariance: PackedCovariance::zero(),
        }
    }

    /// Begins at a pose; what was known of the biases is kept, past poses and landmarks are forgotten.
    pub fn begin(&mut self, state: &Ekf) {
        for key in 0..KEYS {
            self.forget_pose(key);
        }
        for landmark in 0..LANDMARKS {
            self.remove_landmark(landmark);
        }
        for axis in POSE..POSE + 3 {
            self.covariance.clear(axis);
        }
        self.pose = state.pose;
        self.anchor = state.pose.position();
        for row in 0..3 {
            for column in 0..=row {
                self.covariance.set(POSE + row, POSE + column, entry(&state.covariance, row, column));
            }
        }
    }

    /// Forgets what was learnt of the biases.
    pub fn begin_biases(&mut self, deviations: &BiasDeviations) {
        self.bias = OdometryBias::default();
        self.laser_yaw = 0.0;
        let biases = [(SCALE, deviations.scale), (STEERING, deviations.steering), (YAW, deviations.laser_yaw)];
        for (state, deviation) in biases {
            self.covariance.clear(state);
            self.covariance.set(state, state, deviation * deviation);
        }
    }

    /// The pose and its covariance.
    #[must_use]
    pub fn state(&self) -> Ekf {
        Ekf {
            pose: self.pose,
            covariance: Matrix3::from_fn(|row, column| self.covariance.get(POSE + row, POSE + column)),
        }
    }

    /// What is known of the odometry's bias.
    #[must_use]
    pub fn bias(&self) -> OdometryBias {
        self.bias
    }

    /// True yaw of the laser minus the assumed one, rad.
    #[must_use]
    pub fn laser_yaw(&self) -> f64 {
        self.laser_yaw
    }

    /// Covariance of all states, free places included.
    #[must_use]
    pub fn covariance(&self) -> &PackedCovariance<STATES, ENTRIES> {
        &self.covariance
    }

    /// Prediction by a motion from which the bias has been taken already. Only the pose's rows and the biases' variances
    /// change. `lever` as in [`BiasJacobian::of`].
    pub fn predict(&mut self, motion: &Motion, lever: Option<f64>, walk: &BiasWalk) {
        let (sine, cosine) = libm::sincos(self.pose.theta);
        let turn = |x: f64, y: f64| (cosine * x - sine * y, sine * x + cosine * y);
        let step = &motion.displacement;
        let (x, y) = turn(step.x, step.y);
        let pose = Pose::new(self.pose.x + x, self.pose.y + y, self.pose.theta + step.theta);
        let moved = pose.position() - self.anchor;
        let jacobian = BiasJacobian::of(step, lever);
        let by_bias =
            [(SCALE, jacobian.scale), (STEERING, jacobian.steering)].map(|(state, [along, across, theta])| {
                let (x, y) = turn(along, across);
                (state, [x, y, theta])
            });
        // F P: the heading and the biases move the pose.
        let mut rows = [[0.0; 3]; STATES];
        for (other, row) in rows.iter_mut().enumerate().take(self.states_in_use()) {
            let of = |state| self.covariance.get(state, other);
            let heading = of(POSE + 2);
            *row = [of(POSE) - moved.y * heading, of(POSE + 1) + moved.x * heading, heading];
            for (state, [x, y, theta]) in &by_bias {
                let bias = of(*state);
                *row = [row[0] + x * bias, row[1] + y * bias, row[2] + theta * bias];
            }
        }
        // (F P) F' for the pose itself.
        let column = |state: usize| rows.get(state).copied().unwrap_or_default();
        let (first, second, heading) = (column(POSE), column(POSE + 1), column(POSE + 2));
        let mut own = Matrix3::zeros();
        for (row, axis) in [0, 1, 2].into_iter().enumerate() {
            let of = |column: &[f64; 3]| column.get(axis).copied().unwrap_or(0.0);
            let mut values = [of(&first) - moved.y * of(&heading), of(&second) + moved.x * of(&heading), of(&heading)];
            for (state, derivative) in &by_bias {
                let bias = of(&column(*state));
                for (value, factor) in values.iter_mut().zip(derivative) {
                    *value += factor * bias;
                }
            }
            own.set_row(row, &SMatrix::<f64, 1, 3>::from(values));
        }
        let turned = Matrix3::new(cosine, -sine, 0.0, sine, cosine, 0.0, 0.0, 0.0, 1.0);
        own += turned * motion.covariance * turned.transpose();
        for (other, row) in rows.iter().enumerate().take(self.states_in_use()) {
            for (axis, value) in row.iter().enumerate() {
                if other >= POSE + 3 {
                    self.covariance.set(POSE + axis, other, *value);
                }
            }
        }
        for row in 0..3 {
            for column in 0..=row {
                let value = 0.5 * (entry(&own, row, column) + entry(&own, column, row));
                self.covariance.set(POSE + row, POSE + column, value);
            }
        }
        for (state, deviation) in [(SCALE, walk.scale), (STEERING, walk.steering), (YAW, walk.laser_yaw)] {
            let variance = f64::from(deviation) * f64::from(deviation) * motion.distance;
            self.covariance.set(state, state, self.covariance.get(state, state) + variance);
        }
        self.pose = pose;
        self.anchor = pose.position();
    }

    /// Covariance of an observation's residual. None if it is not finite.
    #[must_use]
    pub fn residual_covariance<const SIZE: usize>(
        &self,
        observation: &SparseLinearisation<SIZE>,
    ) -> SMatrix<f64, SIZE, SIZE> {
        let mut covariance = observation.covariance;
        for (first, by_first) in &observation.terms {
            for (second, by_second) in &observation.terms {
                covariance += by_first * self.covariance.get(*first, *second) * by_second.transpose();
            }
        }
        covariance
    }

    /// Correction of all states by an observation that was linearised at this state. False, and nothing changed, if the
    /// residual's covariance is singular or not finite.
    pub fn correct<const SIZE: usize>(&mut self, observation: &SparseLinearisation<SIZE>) -> bool {
        let count = self.states_in_use();
        let mut shares = self.covariance.cross(observation, count);
        let mut residual_covariance = observation.covariance;
        for (state, derivative) in &observation.terms {
            let Some(cross) = shares.get(*state) else { return false };
            residual_covariance += derivative * cross.transpose();
        }
        let Some(root) = residual_covariance.cholesky() else { return false };
        let root = root.unpack();
        let Some(residual) = root.solve_lower_triangular(&observation.residual) else { return false };
        if !residual.iter().all(|value| value.is_finite()) {
            return false;
        }
        // P - P H' S^-1 H P, symmetric whatever the rounding.
        for share in shares.iter_mut().take(count) {
            let Some(whitened) = root.solve_lower_triangular(share) else { return false };
            *share = whitened;
        }
        self.covariance.subtract(&shares, count);
        self.shift(&shares, &residual);
        true
    }

    /// Adds the gain times the residual to all states, both given in units in which the residual has unit covariance.
    fn shift<const SIZE: usize>(&mut self, shares: &[SVector<f64, SIZE>; STATES], residual: &SVector<f64, SIZE>) {
        let change = |state: usize| shares.get(state).map_or(0.0, |share| share.dot(residual));
        let moved = |pose: &Pose, state: usize| {
            Pose::new(pose.x + change(state), pose.y + change(state + 1), pose.theta + change(state + 2))
        };
        self.pose = moved(&self.pose, POSE);
        self.bias.scale += change(SCALE);
        self.bias.steering += change(STEERING);
        self.laser_yaw = wrap(self.laser_yaw + change(YAW));
        for (slot, key) in self.keys.iter_mut().enumerate() {
            if let Some(key) = key {
                key.pose = moved(&key.pose, key_state(slot));
            }
        }
        for (slot, landmark) in self.landmarks.iter_mut().enumerate() {
            if let Some(landmark) = landmark {
                let state = landmark_state::<KEYS>(slot);
                landmark.position += Point::new(change(state), change(state + 1));
            }
        }
    }

    /// Copies the present pose to a place for past poses; what was there is forgotten.
    pub fn remember_pose(&mut self, key: usize) {
        let Some(place) = self.keys.get_mut(key) else { return };
        *place = Some(PastPose { pose: self.pose, anchor: self.anchor });
        let state = key_state(key);
        for axis in 0..3 {
            self.covariance.clear(state + axis);
        }
        for axis in 0..3 {
            for other in 0..STATES {
                if !(state..state + 3).contains(&other) {
                    let value = self.covariance.get(POSE + axis, other);
                    self.covariance.set(state + axis, other, value);
                }
            }
            for other in 0..3 {
                let value = self.covariance.get(POSE + axis, POSE + other);
                self.covariance.set(state + axis, state + other, value);
            }
        }
    }

    /// Frees a place for past poses.
    pub fn forget_pose(&mut self, key: usize) {
        if let Some(place) = self.keys.get_mut(key) {
            *place = None;
            for axis in 0..3 {
                self.covariance.clear(key_state(key) + axis);
            }
        }
    }

    /// A past pose.
    #[must_use]
    pub fn past_pose(&self, key: usize) -> Option<Pose> {
        self.keys.get(key).copied().flatten().map(|key| key.pose)
    }

    /// Adds a landmark at a free place of the state whose position (m, in W) is known beforehand with that variance
    /// (m^2) an axis.
    pub fn add_known_landmark(&mut self, landmark: usize, position: Point, variance: f64) {
        self.remove_landmark(landmark);
        if let Some(place) = self.landmarks.get_mut(landmark) {
            *place = Some(StateLandmark { position, anchor: position });
            for axis in 0..2 {
                let state = landmark_state::<KEYS>(landmark) + axis;
                self.covariance.set(state, state, variance);
            }
        }
    }

    /// Marginalises a landmark: it is forgotten, what it has told is kept.
    pub fn remove_landmark(&mut self, landmark: usize) {
        if let Some(place) = self.landmarks.get_mut(landmark)
            && place.take().is_some()
        {
            for axis in 0..2 {
                self.covariance.clear(landmark_state::<KEYS>(landmark) + axis);
            }
        }
    }

    /// Position of a landmark in W, m.
    #[must_use]
    pub fn landmark(&self, landmark: usize) -> Option<Point> {
        self.landmarks.get(landmark).copied().flatten().map(|landmark| landmark.position)
    }

    /// States up to the last landmark.
    pub(super) fn states_in_use(&self) -> usize {
        let landmarks = self.landmarks.iter().rposition(Option::is_some).map_or(0, |last| last + 1);
        augmented_states(KEYS, landmarks)
    }
}

impl<const KEYS: usize, const LANDMARKS: usize, const STATES: usize, const ENTRIES: usize> Default
    for Augmented<KEYS, LANDMARKS, STATES, ENTRIES>
{
    fn default() -> Self {
        Self::new()
    }
}

/// First state of a past pose.
pub(super) fn key_state(key: usize) -> usize {
    KEYS_FROM + 3 * key
}

/// First state of a landmark behind `KEYS` past poses.
pub(super) fn landmark_state<const KEYS: usize>(landmark: usize) -> usize {
    KEYS_FROM + 3 * KEYS + 2 * landmark
}

fn entry(matrix: &Matrix3<f64>, row: usize, column: usize) -> f64 {
    matrix.get((row, column)).copied().unwrap_or(0.0)
}

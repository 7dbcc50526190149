//! The state and its covariance, and the two steps of the filter.
//!
//! One filter for all modes: the pose alone, or together with what it depends on, which are biases of odometry and laser, past
//! poses, and landmarks found on the way. All correlations are kept, so that a landmark which was placed with a wrong heading
//! is known to be wrong with it. The angle of a map that the vehicle has made itself cannot be observed, and linearisation
//! at ever new estimates would invent knowledge of it; so with slots the Jacobians are those of first estimates (Huang,
//! Mourikis and Roumeliotis, "Observability-based rules for designing consistent EKF SLAM estimators", IJRR 2010).

use nalgebra::{Matrix2, Matrix3, SMatrix, SVector, Vector2, Vector3};
use serde::{Deserialize, Serialize};

use super::biases::{BiasModel, SCALE, STEERING, YAW};
use super::cholesky::Root;
use super::positive_semidefinite::make_positive_semidefinite;
use super::slots::{PastPose, PoseOnly, Slots, StateLandmark, Storage, pose_state, slot_states, storage};
use super::viewpoint::{Believed, Viewpoint};
use super::{Linearisation, Observation, PackedCovariance};
use crate::geometry::{Point, Pose, larger_axis, wrap};
use crate::measurement::LaserId;
use crate::odometry::{BiasJacobian, Motion, OdometryBias};

/// The extended Kalman filter (K 5.3) with room for `S` beside the pose.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct Ekf<S: Slots = PoseOnly> {
    /// Pose of R in W (K 5.1).
    pub pose: Pose,
    #[serde(with = "storage")]
    pub(super) anchor: S::Anchor,
    #[serde(with = "storage")]
    pub(super) biases: S::Biases,
    #[serde(with = "storage")]
    pub(super) poses: S::PerPose<Option<PastPose>>,
    #[serde(with = "storage")]
    pub(super) landmarks: S::PerLandmark<Option<StateLandmark>>,
    pub(super) covariance: PackedCovariance<S>,
}

impl Copy for Ekf {}

impl PartialEq for Ekf {
    fn eq(&self, other: &Self) -> bool {
        self.pose == other.pose && self.covariance() == other.covariance()
    }
}

/// The landmark that an observation is compared with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Landmark {
    /// It is not in the state.
    Known {
        /// Position in W, m.
        position: Point,
        /// Variance of the position an axis, m^2.
        variance: f64,
    },
    /// It is in this slot of the state.
    Slot(usize),
}

/// How far an observation is from what was expected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Innovation {
    /// Observation minus expectation, in the units of the observation.
    pub residual: Vector2<f64>,
    /// Covariance of the residual (K 5.5: the bracket).
    pub covariance: Matrix2<f64>,
    /// Squared Mahalanobis length of the residual; chi-square with two degrees of freedom if all is well.
    pub normalised_square: f64,
}

impl Innovation {
    /// None if the covariance is singular or not finite.
    #[must_use]
    pub fn new(residual: Vector2<f64>, covariance: Matrix2<f64>) -> Option<Self> {
        let normalised_square = (residual.transpose() * invert(&covariance)? * residual).x;
        normalised_square.is_finite().then_some(Self { residual, covariance, normalised_square })
    }
}

impl Ekf {
    /// A pose that is known with these standard deviations, m and rad.
    #[must_use]
    pub fn new(pose: Pose, position_deviation: f64, heading_deviation: f64) -> Self {
        let position = position_deviation * position_deviation;
        let heading = heading_deviation * heading_deviation;
        Self::with_covariance(pose, &Matrix3::from_diagonal(&Vector3::new(position, position, heading)))
    }

    /// A pose with the covariance of x, y (m) and heading (rad), in W.
    #[must_use]
    pub fn with_covariance(pose: Pose, covariance: &Matrix3<f64>) -> Self {
        let mut filter = Self::empty();
        filter.pose = pose;
        filter.set_pose_covariance(covariance);
        filter
    }

    /// Prediction of the pose, K 5.3 and 5.4.
    pub fn predict(&mut self, motion: &Motion) {
        self.predict_with(motion, &BiasModel::NONE);
    }

    /// The covariance as outputs state it: xx, xy, yy, x-heading, y-heading, heading-heading; m^2, m rad, rad^2. It is
    /// positive semidefinite, but for 1e-4 in a correlation.
    #[must_use]
    pub fn covariance_entries(&self) -> [f64; 6] {
        let mut covariance = self.covariance();
        make_positive_semidefinite(&mut covariance);
        [covariance.m11, covariance.m12, covariance.m22, covariance.m13, covariance.m23, covariance.m33]
    }

    /// Standard deviation of the position in its worst direction, m.
    #[must_use]
    pub fn position_deviation(&self) -> f64 {
        let of = |row, column| self.covariance.get(row, column);
        let (xx, xy, yy) = (of(0, 0), of(0, 1), of(1, 1));
        libm::sqrt(larger_axis(xx, xy, yy).max(0.0))
    }

    /// Standard deviation of the heading, rad.
    #[must_use]
    pub fn heading_deviation(&self) -> f64 {
        libm::sqrt(self.covariance.get(2, 2).max(0.0))
    }
}

impl<S: Slots> Ekf<S> {
    /// A filter that knows its pose, the origin, exactly, and no bias.
    #[must_use]
    #[inline(always)]
    pub fn empty() -> Self {
        Self {
            pose: Pose { x: 0.0, y: 0.0, theta: 0.0 },
            anchor: S::Anchor::empty(),
            biases: S::Biases::empty(),
            poses: S::PerPose::empty(),
            landmarks: S::PerLandmark::empty(),
            covariance: PackedCovariance::zero(),
        }
    }

    /// The pose and its covariance.
    #[must_use]
    pub fn state(&self) -> Ekf {
        Ekf::with_covariance(self.pose, &self.covariance())
    }

    /// Covariance of x, y (m) and heading (rad), in W.
    #[must_use]
    pub fn covariance(&self) -> Matrix3<f64> {
        let of = |row, column| self.covariance.get(row, column);
        let (xy, xh, yh) = (of(0, 1), of(0, 2), of(1, 2));
        Matrix3::new(of(0, 0), xy, xh, xy, of(1, 1), yh, xh, yh, of(2, 2))
    }

    /// Covariance of all states, free slots included.
    #[must_use]
    pub fn packed_covariance(&self) -> &PackedCovariance<S> {
        &self.covariance
    }

    /// What is known of the odometry's bias.
    #[must_use]
    pub fn bias(&self) -> OdometryBias {
        match self.biases.as_ref() {
            [scale, steering, _] => OdometryBias { scale: *scale, steering: *steering },
            _ => OdometryBias::default(),
        }
    }

    /// True yaw of the laser minus the assumed one, rad.
    #[must_use]
    pub fn laser_yaw(&self) -> f64 {
        self.biases.as_ref().get(YAW - SCALE).copied().unwrap_or(0.0)
    }

    /// Variances of x, y and heading.
    pub(super) fn pose_variances(&self) -> [f64; 3] {
        [0, 1, 2].map(|state| self.covariance.get(state, state))
    }

    /// Makes the pose less sure: its covariance grows by a factor, and with it what it has in common with all other states.
    pub(super) fn widen_pose(&mut self, factor: f64) {
        if factor <= 1.0 {
            return;
        }
        let root = libm::sqrt(factor);
        for state in 0..3 {
            for other in 0..S::STATES {
                let by = if other < 3 { if other <= state { factor } else { continue } } else { root };
                self.covariance.set(state, other, by * self.covariance.get(state, other));
            }
        }
    }

    /// Makes the variances of x, y and heading no less than these.
    pub(super) fn raise_pose_variances(&mut self, least: [f64; 3]) {
        for (state, least) in least.into_iter().enumerate() {
            if self.covariance.get(state, state) < least {
                self.covariance.set(state, state, least);
            }
        }
    }

    pub(super) fn set_pose_covariance(&mut self, covariance: &Matrix3<f64>) {
        self.set_covariance_from(0, covariance);
    }

    /// Sets the covariance of the three states that begin at `first`.
    pub(super) fn set_covariance_from(&mut self, first: usize, covariance: &Matrix3<f64>) {
        let entries = [
            (0, 0, covariance.m11),
            (1, 0, covariance.m21),
            (1, 1, covariance.m22),
            (2, 0, covariance.m31),
            (2, 1, covariance.m32),
            (2, 2, covariance.m33),
        ];
        for (row, column, value) in entries {
            self.covariance.set(first + row, first + column, value);
        }
    }

    /// Position of the pose for the Jacobians, m.
    pub(super) fn anchor(&self) -> Point {
        self.anchor.as_ref().first().copied().unwrap_or(self.pose.position())
    }

    pub(super) fn has_biases(&self) -> bool {
        !self.biases.as_ref().is_empty()
    }

    /// States up to the last slot that is in use.
    pub(super) fn states_in_use(&self) -> usize {
        let poses = self.poses.as_ref();
        if let Some(last) = self.landmarks.as_ref().iter().rposition(Option::is_some) {
            return slot_states(poses.len(), last + 1);
        }
        let last = poses.iter().rposition(Option::is_some);
        last.map_or(if self.has_biases() { pose_state(0) } else { SCALE }, |last| pose_state(last + 1))
    }

    /// Prediction, K 5.3 and 5.4: `F P F' + G Q G'`, written out, as `F` differs from identity in the pose's rows only and
    /// `G` turns by the heading. The bias has been taken from the motion already.
    pub fn predict_with(&mut self, motion: &Motion, model: &BiasModel) {
        let (sine, cosine) = libm::sincos(self.pose.theta);
        let turn = |x: f64, y: f64| (cosine * x - sine * y, sine * x + cosine * y);
        let step = &motion.displacement;
        let (x, y) = turn(step.x, step.y);
        let pose = Pose::new(self.pose.x + x, self.pose.y + y, self.pose.theta + step.theta);
        let moved = self.anchor.as_ref().first().map_or(Point::new(x, y), |anchor| pose.position() - anchor);
        let count = self.states_in_use();
        let jacobian = if self.has_biases() { Some(BiasJacobian::of(step, model.lever)) } else { None };
        let by_bias = jacobian.map(|jacobian| {
            [(SCALE, jacobian.scale), (STEERING, jacobian.steering)].map(|(state, [along, across, theta])| {
                let (x, y) = turn(along, across);
                (state, Vector3::new(x, y, theta))
            })
        });
        let mut own = self.moved_covariance(0, &moved) + turned(&motion.covariance, sine, cosine);
        // The heading and the biases move the pose, and with it what it has in common with the other states.
        for other in SCALE..count {
            let of = |state| self.covariance.get(state, other);
            let heading = of(2);
            let by_pose = Vector3::new(of(0) - moved.y * heading, of(1) + moved.x * heading, heading);
            let mut row = by_pose;
            for (state, derivative) in by_bias.iter().flatten() {
                row += derivative * of(*state);
            }
            for (axis, value) in row.iter().enumerate() {
                self.covariance.set(axis, other, *value);
            }
            for (_, derivative) in by_bias.iter().flatten().filter(|(state, _)| *state == other) {
                own += by_pose * derivative.transpose() + derivative * row.transpose();
            }
        }
        self.set_pose_covariance(&own);
        if self.has_biases() {
            let walk = &model.walk;
            for (state, deviation) in [(SCALE, walk.scale), (STEERING, walk.steering), (YAW, walk.laser_yaw)] {
                let variance = f64::from(deviation) * f64::from(deviation) * motion.distance;
                self.covariance.set(state, state, self.covariance.get(state, state) + variance);
            }
        }
        self.pose = pose;
        self.anchor.as_mut().fill(pose.position());
    }

    /// `F P F'` of a pose alone whose states begin at `first`, and whose heading's error moves its position sideways by `moved`, m, in W.
    pub(super) fn moved_covariance(&self, first: usize, moved: &Point) -> Matrix3<f64> {
        let of = |row: usize, column: usize| self.covariance.get(first + row, first + column);
        let (hh, xh, yh) = (of(2, 2), of(0, 2), of(1, 2));
        let (x_heading, y_heading) = (xh - moved.y * hh, yh + moved.x * hh);
        let xx = of(0, 0) - moved.y * (xh + x_heading);
        let xy = of(0, 1) - moved.y * yh + moved.x * x_heading;
        let yy = of(1, 1) + moved.x * (yh + y_heading);
        Matrix3::new(xx, xy, x_heading, xy, yy, y_heading, x_heading, y_heading, hh)
    }

    /// Where a laser is that is mounted at `mount` in R. The yaw of the first one is part of the state.
    #[must_use]
    pub fn viewpoint(&self, laser: LaserId, mount: &Pose) -> Viewpoint {
        let yaw = (laser == LaserId::FIRST && self.has_biases()).then(|| self.laser_yaw());
        Viewpoint::new(&self.pose, self.anchor(), mount, yaw)
    }

    /// Compares an observation from a viewpoint of this state with a landmark. None if the landmark is at the sensor, or in
    /// no slot.
    #[must_use]
    pub fn observe(
        &self,
        from: &Viewpoint,
        observation: &Observation,
        landmark: &Landmark,
    ) -> Option<Linearisation<2>> {
        let (believed, slot) = match landmark {
            Landmark::Known { position, variance } => {
                (Believed { position: *position, anchor: *position, variance: *variance }, None)
            }
            Landmark::Slot(slot) => {
                let landmark = self.landmarks.as_ref().get(*slot).copied().flatten()?;
                (Believed { position: landmark.position, anchor: landmark.anchor, variance: 0.0 }, Some(*slot))
            }
        };
        let model = observation.model(from, &believed)?;
        let [by_x, by_y] = model.by_position;
        let mut linearisation = Linearisation::new(model.residual, model.covariance);
        linearisation.by_pose = [by_x, by_y, model.by_heading];
        if from.has_yaw {
            linearisation.add(YAW, model.by_yaw);
        }
        if let Some(slot) = slot {
            let state = self.landmark_state(slot);
            linearisation.add(state, -by_x);
            linearisation.add(state + 1, -by_y);
        }
        Some(linearisation)
    }

    /// First state of a landmark.
    pub(super) fn landmark_state(&self, slot: usize) -> usize {
        slot_states(self.poses.as_ref().len(), slot)
    }

    /// Covariance of an observation's residual.
    #[must_use]
    pub fn residual_covariance<const SIZE: usize>(
        &self,
        observation: &Linearisation<SIZE>,
    ) -> SMatrix<f64, SIZE, SIZE> {
        let mut covariance = observation.covariance;
        let [by_x, by_y, by_heading] = &observation.by_pose;
        let by_pose_of = |state| {
            let of = |axis| self.covariance.get(axis, state);
            by_x * of(0) + by_y * of(1) + by_heading * of(2)
        };
        for (axis, derivative) in observation.by_pose.iter().enumerate() {
            covariance += derivative * by_pose_of(axis).transpose();
        }
        for (state, derivative) in &observation.terms {
            let by_pose = by_pose_of(*state);
            let mut cross = by_pose;
            for (other, by_other) in &observation.terms {
                cross += by_other * self.covariance.get(*state, *other);
            }
            covariance += cross * derivative.transpose() + derivative * by_pose.transpose();
        }
        covariance
    }

    /// The innovation of an observation that was linearised at this state. None if its covariance is singular or not
    /// finite.
    #[must_use]
    pub fn innovation(&self, observation: &Linearisation<2>) -> Option<Innovation> {
        Innovation::new(observation.residual, self.residual_covariance(observation))
    }

    /// Correction of all states, K 5.5 to 5.7, by an observation that was linearised at this state. False, and nothing
    /// changed, if the residual's covariance is singular or not finite.
    pub fn correct<const SIZE: usize>(&mut self, observation: &Linearisation<SIZE>) -> bool {
        let count = self.states_in_use();
        let mut rows = self.covariance.cross(observation, count);
        let shares = rows.as_mut();
        let mut residual_covariance = observation.covariance;
        for (derivative, cross) in observation.by_pose.iter().zip(shares.iter()) {
            residual_covariance += derivative * cross.transpose();
        }
        for (state, derivative) in &observation.terms {
            let Some(cross) = shares.get(*state) else { return false };
            residual_covariance += derivative * cross.transpose();
        }
        let Some(root) = Root::of(&residual_covariance) else { return false };
        let residual = root.whiten(&observation.residual);
        if !residual.iter().all(|value| value.is_finite()) {
            return false;
        }
        // P - P H' S^-1 H P, symmetric whatever the rounding.
        for share in shares.iter_mut().take(count) {
            *share = root.whiten(share);
        }
        self.covariance.subtract(shares, count);
        self.shift(shares, &residual);
        if S::STATES == SCALE {
            let mut covariance = self.covariance();
            make_positive_semidefinite(&mut covariance);
            self.set_pose_covariance(&covariance);
        }
        true
    }

    /// Adds the gain times the residual to all states, both given in units in which the residual has unit covariance.
    fn shift<const SIZE: usize>(&mut self, shares: &[SVector<f64, SIZE>], residual: &SVector<f64, SIZE>) {
        let change = |state: usize| shares.get(state).map_or(0.0, |share| share.dot(residual));
        let moved = |pose: &Pose, state: usize| {
            Pose::new(pose.x + change(state), pose.y + change(state + 1), pose.theta + change(state + 2))
        };
        self.pose = moved(&self.pose, 0);
        if let [scale, steering, yaw] = self.biases.as_mut() {
            *scale += change(SCALE);
            *steering += change(STEERING);
            *yaw = wrap(*yaw + change(YAW));
        }
        let poses = self.poses.as_mut();
        let landmarks_from = slot_states(poses.len(), 0);
        for (slot, past) in poses.iter_mut().enumerate() {
            if let Some(past) = past {
                past.pose = moved(&past.pose, pose_state(slot));
            }
        }
        for (slot, landmark) in self.landmarks.as_mut().iter_mut().enumerate() {
            if let Some(landmark) = landmark {
                let state = landmarks_from + 2 * slot;
                landmark.position += Point::new(change(state), change(state + 1));
            }
        }
    }
}

/// A covariance of x, y and heading in R, seen from W.
fn turned(covariance: &Matrix3<f64>, sine: f64, cosine: f64) -> Matrix3<f64> {
    let q = covariance;
    let (xh, yh) = (cosine * q.m13 - sine * q.m23, sine * q.m13 + cosine * q.m23);
    let (along, across, both) = (cosine * cosine, sine * sine, sine * cosine);
    let xx = along * q.m11 - 2.0 * both * q.m12 + across * q.m22;
    let xy = both * (q.m11 - q.m22) + (along - across) * q.m12;
    let yy = across * q.m11 + 2.0 * both * q.m12 + along * q.m22;
    Matrix3::new(xx, xy, xh, xy, yy, yh, xh, yh, q.m33)
}

/// The inverse of a symmetric positive matrix; None if it is not one.
fn invert(matrix: &Matrix2<f64>) -> Option<Matrix2<f64>> {
    let determinant = matrix.m11 * matrix.m22 - matrix.m12 * matrix.m21;
    if !(determinant.is_finite() && determinant > 0.0 && matrix.m11 > 0.0) {
        return None;
    }
    let scale = 1.0 / determinant;
    scale
        .is_finite()
        .then(|| Matrix2::new(matrix.m22 * scale, -matrix.m12 * scale, -matrix.m21 * scale, matrix.m11 * scale))
}

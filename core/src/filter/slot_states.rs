//! Biases, past poses and landmarks as parts of the state.

use nalgebra::{Matrix2, Matrix3, Vector3};

use super::biases::{BiasDeviations, SCALE, STEERING, YAW};
use super::slots::{PastPose, Slots, StateLandmark, pose_state};
use super::viewpoint::{Viewpoint, left};
use super::{Cartesian, Ekf};
use crate::geometry::{Point, Pose};

impl<S: Slots> Ekf<S> {
    /// Begins at a pose; what was known of the biases is kept, past poses and landmarks are forgotten.
    pub fn begin(&mut self, state: &Ekf) {
        self.forget_poses();
        for slot in 0..self.landmarks.as_ref().len() {
            self.remove_landmark(slot);
        }
        for axis in 0..SCALE {
            self.covariance.clear(axis);
        }
        self.pose = state.pose;
        self.anchor.as_mut().fill(state.pose.position());
        self.set_pose_covariance(&state.covariance());
    }

    /// Forgets what was learnt of the biases.
    pub fn begin_biases(&mut self, deviations: &BiasDeviations) {
        self.biases.as_mut().fill(0.0);
        let biases = [(SCALE, deviations.scale), (STEERING, deviations.steering), (YAW, deviations.laser_yaw)];
        for (state, deviation) in biases.into_iter().take(self.biases.as_ref().len()) {
            self.covariance.clear(state);
            self.covariance.set(state, state, deviation * deviation);
        }
    }

    /// Copies the present pose to a slot for past poses; what was there is forgotten.
    pub fn remember_pose(&mut self, slot: usize) {
        let past = PastPose { pose: self.pose, anchor: self.anchor() };
        let Some(place) = self.poses.as_mut().get_mut(slot) else { return };
        *place = Some(past);
        let state = pose_state(slot);
        for axis in 0..3 {
            self.covariance.clear(state + axis);
        }
        for axis in 0..3 {
            for other in 0..S::STATES {
                if !(state..state + 3).contains(&other) {
                    let value = self.covariance.get(axis, other);
                    self.covariance.set(state + axis, other, value);
                }
            }
            for other in 0..3 {
                let value = self.covariance.get(axis, other);
                self.covariance.set(state + axis, state + other, value);
            }
        }
    }

    /// Moves a past pose to where the present one is, by the way that S, mounted at `mount` in R, has seen: what its error has been is its
    /// error there, with that of the direction in which S is taken to look, whatever that of the present pose is.
    pub fn carry_past_pose(&mut self, slot: usize, mount: &Pose) {
        let present = PastPose { pose: self.pose, anchor: self.anchor() };
        let yaw = self.laser_yaw();
        let to = Viewpoint::new(&present.pose, present.anchor, mount, Some(yaw));
        let Some(Some(past)) = self.poses.as_mut().get_mut(slot) else { return };
        let from = Viewpoint::new(&past.pose, past.anchor, mount, Some(yaw));
        let moved = to.anchor - from.anchor;
        let by_yaw = left(&(moved + to.arm - from.arm));
        *past = present;
        let state = pose_state(slot);
        let mut own = self.moved_covariance(state, &moved);
        let of = |axis: usize| self.covariance.get(state + axis, YAW);
        let with_yaw = Vector3::new(of(0) - moved.y * of(2), of(1) + moved.x * of(2), of(2));
        let by_yaw = Vector3::new(by_yaw.x, by_yaw.y, 0.0);
        let yaw_variance = self.covariance.get(YAW, YAW);
        own += with_yaw * by_yaw.transpose() + by_yaw * (with_yaw + by_yaw * yaw_variance).transpose();
        for other in (0..S::STATES).filter(|other| !(state..state + 3).contains(other)) {
            let of = |axis: usize| self.covariance.get(state + axis, other);
            let yaw = self.covariance.get(YAW, other);
            let (x, y) = (of(0) - moved.y * of(2) + by_yaw.x * yaw, of(1) + moved.x * of(2) + by_yaw.y * yaw);
            self.covariance.set(state, other, x);
            self.covariance.set(state + 1, other, y);
        }
        self.set_covariance_from(state, &own);
    }

    /// Makes a past pose less sure by the covariance of x, y (m) and heading (rad), in W, of an error that nothing else has.
    pub fn doubt_past_pose(&mut self, slot: usize, covariance: &Matrix3<f64>) {
        if self.past_pose(slot).is_some() {
            let state = pose_state(slot);
            self.set_covariance_from(state, &(self.moved_covariance(state, &Point::zeros()) + covariance));
        }
    }

    /// Makes the present pose less sure by these variances, m^2 an axis and rad^2.
    pub fn doubt_pose(&mut self, position: f64, heading: f64) {
        for (state, variance) in [position, position, heading].into_iter().enumerate() {
            self.covariance.set(state, state, self.covariance.get(state, state) + variance);
        }
    }

    /// Frees a slot for past poses.
    pub fn forget_pose(&mut self, slot: usize) {
        if let Some(place) = self.poses.as_mut().get_mut(slot)
            && place.take().is_some()
        {
            for axis in 0..3 {
                self.covariance.clear(pose_state(slot) + axis);
            }
        }
    }

    /// Frees all of them.
    pub fn forget_poses(&mut self) {
        for slot in 0..self.poses.as_ref().len() {
            self.forget_pose(slot);
        }
    }

    /// A past pose.
    #[must_use]
    pub fn past_pose(&self, slot: usize) -> Option<Pose> {
        self.poses.as_ref().get(slot).copied().flatten().map(|past| past.pose)
    }

    /// Adds a landmark at a slot whose position (m, in W) is known beforehand with that variance (m^2) an axis.
    pub fn add_known_landmark(&mut self, slot: usize, position: Point, variance: f64) {
        self.remove_landmark(slot);
        let first = self.landmark_state(slot);
        if let Some(place) = self.landmarks.as_mut().get_mut(slot) {
            *place = Some(StateLandmark { position, anchor: position });
            for state in [first, first + 1] {
                self.covariance.set(state, state, variance);
            }
        }
    }

    /// Marginalises a landmark: it is forgotten, what it has told is kept.
    pub fn remove_landmark(&mut self, slot: usize) {
        let first = self.landmark_state(slot);
        if let Some(place) = self.landmarks.as_mut().get_mut(slot)
            && place.take().is_some()
        {
            for state in [first, first + 1] {
                self.covariance.clear(state);
            }
        }
    }

    /// Position of a landmark in W, m.
    #[must_use]
    pub fn landmark(&self, slot: usize) -> Option<Point> {
        self.landmarks.as_ref().get(slot).copied().flatten().map(|landmark| landmark.position)
    }

    /// Adds a landmark at a slot, where it was seen from a viewpoint of this state.
    pub fn add_landmark(&mut self, slot: usize, from: &Viewpoint, seen: &Cartesian) {
        let position = from.locate(&seen.position);
        // Known to nothing at first; the observation's inverse then gives its correlations.
        self.add_known_landmark(slot, position, 0.0);
        let state = self.landmark_state(slot);
        let Some(place) = self.landmarks.as_mut().get_mut(slot) else { return };
        let anchor = from.anchor + from.arm + from.outwards(&seen.position);
        *place = Some(StateLandmark { position, anchor });
        let reach = anchor - from.anchor;
        let (by_heading, by_yaw) = (left(&reach), left(&(reach - from.arm)));
        let shares = [(by_heading.x, by_yaw.x), (by_heading.y, by_yaw.y)];
        for other in 0..S::STATES {
            if (state..state + 2).contains(&other) {
                continue;
            }
            let yaw = if from.has_yaw { self.covariance.get(YAW, other) } else { 0.0 };
            let heading = self.covariance.get(2, other);
            for (axis, (by_heading, by_yaw)) in shares.iter().enumerate() {
                let value = self.covariance.get(axis, other) + by_heading * heading + by_yaw * yaw;
                self.covariance.set(state + axis, other, value);
            }
        }
        let turn = Matrix2::new(from.cosine, -from.sine, from.sine, from.cosine);
        let own = turn * seen.covariance * turn.transpose();
        for row in 0..2 {
            for (column, (by_heading, by_yaw)) in shares.iter().enumerate().take(row + 1) {
                let of = |other: usize| self.covariance.get(state + row, other);
                let yaw = if from.has_yaw { of(YAW) } else { 0.0 };
                let value = of(column) + by_heading * of(2) + by_yaw * yaw;
                let noise = own.get((row, column)).copied().unwrap_or(0.0);
                self.covariance.set(state + row, state + column, value + noise);
            }
        }
    }
}

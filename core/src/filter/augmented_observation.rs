//! What an augmented filter can be told: a landmark seen from S, and a past place of S seen from the present one.

use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

use super::augmented::{POSE, StateLandmark, YAW, key_state, landmark_state};
use super::{Augmented, Cartesian, SparseLinearisation};
use crate::geometry::{Point, Pose, difference};

/// Pose of S relative to a past one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RelativePose {
    /// Pose of S in the past S.
    pub pose: Pose,
    /// Covariance of x, y (m) and heading (rad), in the past S.
    pub covariance: Matrix3<f64>,
}

/// Where S is in W, and how that turns.
struct Sensor {
    /// Position minus that of R, m, in W.
    arm: Point,
    sine: f64,
    cosine: f64,
}

impl Sensor {
    fn of(pose: &Pose, laser: &Pose, yaw: f64) -> Self {
        let (heading_sine, heading_cosine) = libm::sincos(pose.theta);
        let (sine, cosine) = libm::sincos(pose.theta + laser.theta + yaw);
        let arm = Point::new(
            heading_cosine * laser.x - heading_sine * laser.y,
            heading_sine * laser.x + heading_cosine * laser.y,
        );
        Self { arm, sine, cosine }
    }

    /// From W to S.
    fn inwards(&self, vector: &Point) -> Vector2<f64> {
        Vector2::new(self.cosine * vector.x + self.sine * vector.y, self.cosine * vector.y - self.sine * vector.x)
    }

    /// From S to W.
    fn outwards(&self, vector: &Point) -> Point {
        Point::new(self.cosine * vector.x - self.sine * vector.y, self.sine * vector.x + self.cosine * vector.y)
    }
}

/// A vector turned to the left by a right angle.
fn left(vector: &Point) -> Point {
    Point::new(-vector.y, vector.x)
}

const AXES: [Point; 2] = [Point::new(1.0, 0.0), Point::new(0.0, 1.0)];

impl<const KEYS: usize, const LANDMARKS: usize, const STATES: usize, const ENTRIES: usize>
    Augmented<KEYS, LANDMARKS, STATES, ENTRIES>
{
    /// Where a point that is seen at `position` in S is in W, m.
    #[must_use]
    pub fn locate(&self, position: &Point, laser: &Pose) -> Point {
        let sensor = Sensor::of(&self.pose, laser, self.laser_yaw);
        self.pose.position() + sensor.arm + sensor.outwards(position)
    }

    /// Compares what was seen with a landmark of the state. None if there is none at that place.
    #[must_use]
    pub fn observe_landmark(&self, landmark: usize, seen: &Cartesian, laser: &Pose) -> Option<SparseLinearisation<2>> {
        let StateLandmark { position, anchor } = self.landmarks.get(landmark).copied().flatten()?;
        let state = landmark_state::<KEYS>(landmark);
        let mut linearisation = self.observe(&position, &anchor, seen, laser);
        let sensor = Sensor::of(&self.pose, laser, self.laser_yaw);
        for (axis, direction) in AXES.iter().enumerate() {
            linearisation = linearisation.with(state + axis, sensor.inwards(direction));
        }
        Some(linearisation)
    }

    /// Compares what was seen with a landmark at `position` (m, in W, known to `variance` m^2 an axis) that is not in the
    /// state.
    #[must_use]
    pub fn observe_known(
        &self,
        position: &Point,
        variance: f64,
        seen: &Cartesian,
        laser: &Pose,
    ) -> SparseLinearisation<2> {
        let mut linearisation = self.observe(position, position, seen, laser);
        linearisation.covariance += Matrix2::identity() * variance;
        linearisation
    }

    fn observe(&self, position: &Point, anchor: &Point, seen: &Cartesian, laser: &Pose) -> SparseLinearisation<2> {
        let sensor = Sensor::of(&self.pose, laser, self.laser_yaw);
        let expected = sensor.inwards(&(position - self.pose.position() - sensor.arm));
        let mut linearisation = SparseLinearisation::new(seen.position - expected, seen.covariance);
        for (axis, direction) in AXES.iter().enumerate() {
            linearisation = linearisation.with(POSE + axis, -sensor.inwards(direction));
        }
        let reach = anchor - self.anchor;
        linearisation
            .with(POSE + 2, -sensor.inwards(&left(&reach)))
            .with(YAW, -sensor.inwards(&left(&(reach - sensor.arm))))
    }

    /// Adds a landmark at a free place of the state, where it was seen.
    pub fn add_landmark(&mut self, landmark: usize, seen: &Cartesian, laser: &Pose) {
        let sensor = Sensor::of(&self.pose, laser, self.laser_yaw);
        let position = self.locate(&seen.position, laser);
        // Known to nothing at first; the observation's inverse then gives its correlations.
        self.add_known_landmark(landmark, position, 0.0);
        let Some(place) = self.landmarks.get_mut(landmark) else { return };
        let anchor = self.anchor + sensor.arm + sensor.outwards(&seen.position);
        *place = Some(StateLandmark { position, anchor });
        let state = landmark_state::<KEYS>(landmark);
        let reach = anchor - self.anchor;
        let (by_heading, by_yaw) = (left(&reach), left(&(reach - sensor.arm)));
        let shares = [(by_heading.x, by_yaw.x), (by_heading.y, by_yaw.y)];
        for other in 0..STATES {
            if (state..state + 2).contains(&other) {
                continue;
            }
            let (heading, yaw) = (self.covariance.get(POSE + 2, other), self.covariance.get(YAW, other));
            for (axis, (by_heading, by_yaw)) in shares.iter().enumerate() {
                let value = self.covariance.get(POSE + axis, other) + by_heading * heading + by_yaw * yaw;
                self.covariance.set(state + axis, other, value);
            }
        }
        let turn = Matrix2::new(sensor.cosine, -sensor.sine, sensor.sine, sensor.cosine);
        let own = turn * seen.covariance * turn.transpose();
        for row in 0..2 {
            for (column, (by_heading, by_yaw)) in shares.iter().enumerate().take(row + 1) {
                let of = |other: usize| self.covariance.get(state + row, other);
                let value = of(POSE + column) + by_heading * of(POSE + 2) + by_yaw * of(YAW);
                let noise = own.get((row, column)).copied().unwrap_or(0.0);
                self.covariance.set(state + row, state + column, value + noise);
            }
        }
    }

    /// Pose of S relative to where it was at a past pose, as it is expected. None if that pose is not remembered.
    #[must_use]
    pub fn expected_relative_pose(&self, key: usize, laser: &Pose) -> Option<Pose> {
        let past = self.keys.get(key).copied().flatten()?;
        let mounted = Pose::new(laser.x, laser.y, laser.theta + self.laser_yaw);
        Some(past.pose.compose(&mounted).between(&self.pose.compose(&mounted)))
    }

    /// Compares the place of S relative to a past one with what is expected. None if that pose is not remembered.
    #[must_use]
    pub fn observe_relative_pose(
        &self,
        key: usize,
        seen: &RelativePose,
        laser: &Pose,
    ) -> Option<SparseLinearisation<3>> {
        let expected = self.expected_relative_pose(key, laser)?;
        let past = self.keys.get(key).copied().flatten()?;
        let (now, then) =
            (Sensor::of(&self.pose, laser, self.laser_yaw), Sensor::of(&past.pose, laser, self.laser_yaw));
        let residual = Vector3::new(
            seen.pose.x - expected.x,
            seen.pose.y - expected.y,
            difference(seen.pose.theta, expected.theta),
        );
        let shift = |vector: &Point| {
            let inwards = then.inwards(vector);
            Vector3::new(inwards.x, inwards.y, 0.0)
        };
        let turn = Vector3::new(0.0, 0.0, 1.0);
        let from_past = self.anchor + now.arm - past.anchor;
        let state = key_state(key);
        let mut linearisation = SparseLinearisation::new(residual, seen.covariance);
        for (axis, direction) in AXES.iter().enumerate() {
            linearisation = linearisation.with(POSE + axis, shift(direction)).with(state + axis, -shift(direction));
        }
        Some(
            linearisation
                .with(POSE + 2, shift(&left(&now.arm)) + turn)
                .with(state + 2, -shift(&left(&from_past)) - turn)
                .with(YAW, -shift(&left(&(from_past - then.arm)))),
        )
    }
}

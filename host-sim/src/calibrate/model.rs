//! The motion of the laser that the encoders claim, with its derivatives.

use agv_core::geometry::Pose;
use agv_core::odometry::Tricycle;
use nalgebra::{SMatrix, Vector2, Vector3};

use super::window::{Step, Window};

/// Number of parameters of [`VehicleModel`].
pub const PARAMETERS: usize = 8;

/// Derivatives of a motion (x, y, rotation) by all parameters.
pub type Derivative = SMatrix<f64, 3, PARAMETERS>;

/// Everything that the joint fit can change.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VehicleModel {
    /// Steering offset forward, rad (K: alpha_F).
    pub offset_forward: f64,
    /// Steering offset backward, rad (K: alpha_B).
    pub offset_backward: f64,
    /// Way of the driving wheel for one tick, m (K: s_w).
    pub drive_scale: f64,
    /// Distance from the rear axle to the steering axis, m (K: L).
    pub wheelbase: f64,
    /// Steering angle over the angle that the nominal steering scale gives.
    pub steering_ratio: f64,
    /// Pose of S in R (K: l).
    pub laser: Pose,
}

impl VehicleModel {
    /// The model that a nominal vehicle and laser stand for.
    #[must_use]
    pub fn nominal(tricycle: &Tricycle, laser: &Pose) -> Self {
        Self {
            offset_forward: tricycle.steering_offset_forward,
            offset_backward: tricycle.steering_offset_backward,
            drive_scale: tricycle.drive_scale,
            wheelbase: tricycle.wheelbase,
            steering_ratio: 1.0,
            laser: *laser,
        }
    }

    /// The nominal vehicle with this model's parameters.
    #[must_use]
    pub fn apply(&self, nominal: &Tricycle) -> Tricycle {
        Tricycle {
            wheelbase: self.wheelbase,
            drive_scale: self.drive_scale,
            steering_scale: nominal.steering_scale * self.steering_ratio,
            steering_offset_forward: self.offset_forward,
            steering_offset_backward: self.offset_backward,
            ..*nominal
        }
    }

    /// The parameters in the order of the derivatives: offsets, drive scale, wheelbase, steering ratio, laser.
    #[must_use]
    pub fn vector(&self) -> [f64; PARAMETERS] {
        let laser = &self.laser;
        [
            self.offset_forward,
            self.offset_backward,
            self.drive_scale,
            self.wheelbase,
            self.steering_ratio,
            laser.x,
            laser.y,
            laser.theta,
        ]
    }

    /// The model with these parameters.
    #[must_use]
    pub fn from_vector(vector: &[f64; PARAMETERS]) -> Self {
        let &[offset_forward, offset_backward, drive_scale, wheelbase, steering_ratio, x, y, heading] = vector;
        let laser = Pose::new(x, y, heading);
        Self { offset_forward, offset_backward, drive_scale, wheelbase, steering_ratio, laser }
    }

    fn steering(&self, step: &Step) -> f64 {
        let offset = if step.ticks < 0.0 { self.offset_backward } else { self.offset_forward };
        self.steering_ratio * step.steering + offset
    }

    /// Displacement of R for one step of constant steering; the rotation is not wrapped.
    fn displacement(&self, step: &Step) -> (Vector2<f64>, f64) {
        let (sine, cosine) = self.steering(step).sin_cos();
        let way = self.drive_scale * step.ticks;
        let rotation = way * sine / self.wheelbase;
        let (half_sine, half_cosine) = (0.5 * rotation).sin_cos();
        (Vector2::new(half_cosine, half_sine) * (way * cosine * sinc(0.5 * rotation).0), rotation)
    }

    /// Motion of R over a window, in R at its start; the rotation is not wrapped.
    #[must_use]
    pub fn motion(&self, steps: &[Step]) -> Vector3<f64> {
        let (mut position, mut heading) = (Vector2::zeros(), 0.0);
        for step in steps {
            let (moved, rotation) = self.displacement(step);
            position += turned(heading, &moved);
            heading += rotation;
        }
        Vector3::new(position.x, position.y, heading)
    }

    /// Motion of S over a window, in S at its start (x, y, unwrapped rotation), and its derivatives.
    #[must_use]
    pub fn laser_motion(&self, window: &Window) -> (Vector3<f64>, Derivative) {
        let (mut position, mut heading) = (Vector2::zeros(), 0.0);
        // Derivatives of R's motion by offset forward, offset backward, scale, wheelbase and ratio.
        let mut by = [(Vector2::zeros(), 0.0); 5];
        for step in &window.steps {
            let steering = self.steering(step);
            let (sine, cosine) = steering.sin_cos();
            let way = self.drive_scale * step.ticks;
            let rotation = way * sine / self.wheelbase;
            let (ratio, slope) = sinc(0.5 * rotation);
            let chord = way * cosine * ratio;
            let direction = turned(heading + 0.5 * rotation, &Vector2::new(1.0, 0.0));
            let across = Vector2::new(-direction.y, direction.x);
            let offset = usize::from(step.ticks < 0.0);
            // Way along, and rotation, of this step by the parameters.
            let by_steering = (-way * sine, way * cosine / self.wheelbase);
            let by_scale = (step.ticks * cosine, step.ticks * sine / self.wheelbase);
            let by_wheelbase = (0.0, -rotation / self.wheelbase);
            let by_ratio = (by_steering.0 * step.steering, by_steering.1 * step.steering);
            let none = (0.0, 0.0);
            let own = [
                if offset == 0 { by_steering } else { none },
                if offset == 1 { by_steering } else { none },
                by_scale,
                by_wheelbase,
                by_ratio,
            ];
            for ((place, turn), (along, rotates)) in by.iter_mut().zip(own) {
                let chord_change = along * ratio + way * cosine * slope * 0.5 * rotates;
                *place += direction * chord_change + across * (chord * (*turn + 0.5 * rotates));
                *turn += rotates;
            }
            position += direction * chord;
            heading += rotation;
        }
        self.seen_from_laser(&position, heading, &by)
    }

    fn seen_from_laser(
        &self,
        position: &Vector2<f64>,
        heading: f64,
        by: &[(Vector2<f64>, f64); 5],
    ) -> (Vector3<f64>, Derivative) {
        let mount = Vector2::new(self.laser.x, self.laser.y);
        let turned_mount = turned(heading, &mount);
        let across_mount = Vector2::new(-turned_mount.y, turned_mount.x);
        let moved = position + turned_mount - mount;
        let seen = turned(-self.laser.theta, &moved);
        let mut derivative = Derivative::zeros();
        let mut put = |column: usize, place: Vector2<f64>, rotation: f64| {
            derivative.set_column(column, &Vector3::new(place.x, place.y, rotation));
        };
        for (column, (place, turn)) in by.iter().enumerate() {
            put(column, turned(-self.laser.theta, &(place + across_mount * *turn)), *turn);
        }
        for (column, axis) in [(5, Vector2::new(1.0, 0.0)), (6, Vector2::new(0.0, 1.0))] {
            put(column, turned(-self.laser.theta, &(turned(heading, &axis) - axis)), 0.0);
        }
        put(7, Vector2::new(seen.y, -seen.x), 0.0);
        (Vector3::new(seen.x, seen.y, heading), derivative)
    }

    /// How the motion of S answers to slip that is a random walk over the way: the covariance for a unit of variance a
    /// metre (1/m).
    #[must_use]
    pub fn slip_covariance(&self, window: &Window) -> nalgebra::Matrix3<f64> {
        let end = self.motion(&window.steps);
        let mount = turned(end.z, &Vector2::new(self.laser.x, self.laser.y));
        let end = Vector2::new(end.x, end.y) + mount;
        let (mut position, mut heading) = (Vector2::zeros(), 0.0);
        let mut covariance = nalgebra::Matrix3::zeros();
        for step in &window.steps {
            // Long steps in pieces, as slip happens all along the arc.
            const LONGEST_PIECE: f64 = 0.2;
            let (sine, cosine) = self.steering(step).sin_cos();
            let way = (self.drive_scale * step.ticks).abs();
            let pieces = (way / self.wheelbase / LONGEST_PIECE).ceil().clamp(1.0, 100.0);
            let piece = Step { ticks: step.ticks / pieces, ..*step };
            for _ in 0..pieces as usize {
                let (moved, rotation) = self.displacement(&piece);
                let middle = position + 0.5 * turned(heading, &moved);
                let turn = sine / self.wheelbase;
                let lever = end - middle;
                let place = turned(heading + 0.5 * rotation, &Vector2::new(cosine, 0.0))
                    + Vector2::new(-lever.y, lever.x) * turn;
                let place = turned(-self.laser.theta, &place);
                let answer = Vector3::new(place.x, place.y, turn);
                covariance += answer * answer.transpose() * (way / pieces);
                position += turned(heading, &moved);
                heading += rotation;
            }
        }
        covariance
    }
}

/// `vector` turned by `angle`.
fn turned(angle: f64, vector: &Vector2<f64>) -> Vector2<f64> {
    let (sine, cosine) = angle.sin_cos();
    Vector2::new(cosine * vector.x - sine * vector.y, sine * vector.x + cosine * vector.y)
}

/// `sin(x)/x` and its derivative.
fn sinc(x: f64) -> (f64, f64) {
    if x.abs() < 1e-3 {
        (1.0 - x * x / 6.0, -x / 3.0 * (1.0 - x * x / 10.0))
    } else {
        let (sine, cosine) = x.sin_cos();
        (sine / x, (cosine - sine / x) / x)
    }
}

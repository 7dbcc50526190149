//! A piece of a drive: what the encoders counted, and how the laser moved.

use agv_core::calibration::{Segment, SegmentBuilder};
use agv_core::geometry::{Pose, wrap};
use agv_core::measurement::Time;
use agv_core::odometry::Tricycle;
use nalgebra::{Matrix3, Vector3};

/// Ticks at one steering angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// Ticks of the driving wheel, signed.
    pub ticks: f64,
    /// Steering angle that the nominal scale gives, without offset, rad.
    pub steering: f64,
}

/// Samples whose steering angles differ by less than this, rad, may be joined,
const SAME_STEERING: f64 = 2e-3;
/// up to so many of them.
const SAMPLES_A_PIECE: usize = 6;
/// What was joined is joined on if its mean angles differ by less than this, rad.
const SAME_MEAN_STEERING: f64 = 1e-4;

/// Ticks times sine and cosine of the steering angle.
#[derive(Clone, Copy, Debug, Default)]
struct Sum {
    sine: f64,
    cosine: f64,
}

impl Sum {
    fn add(&mut self, other: &Self) {
        self.sine += other.sine;
        self.cosine += other.cosine;
    }

    fn step(&self) -> Step {
        let sign = self.cosine.signum();
        let steering = (sign * self.sine).atan2(sign * self.cosine);
        Step { ticks: sign * self.sine.hypot(self.cosine), steering }
    }

    fn is_like(&self, other: &Self) -> bool {
        self.cosine * other.cosine > 0.0 && (self.step().steering - other.step().steering).abs() < SAME_MEAN_STEERING
    }
}

/// Steps of a window as they come: short pieces, in which the noise of the steering angle averages, and equal pieces
/// joined to one.
#[derive(Clone, Debug, Default)]
pub struct Steps {
    done: Vec<Step>,
    /// Pieces that are one step.
    joined: Sum,
    piece: Sum,
    samples: usize,
    first: f64,
}

impl Steps {
    /// Adds ticks at a steering angle.
    pub fn add(&mut self, ticks: f64, steering: f64) {
        if ticks == 0.0 {
            return;
        }
        let is_same = self.piece.cosine * ticks > 0.0 && (steering - self.first).abs() < SAME_STEERING;
        if !is_same || self.samples >= SAMPLES_A_PIECE {
            self.close_piece();
            self.first = steering;
        }
        let (sine, cosine) = steering.sin_cos();
        self.piece.add(&Sum { sine: ticks * sine, cosine: ticks * cosine });
        self.samples += 1;
    }

    fn close_piece(&mut self) {
        let piece = std::mem::take(&mut self.piece);
        self.samples = 0;
        if piece.cosine == 0.0 {
            return;
        }
        if !self.joined.is_like(&piece) {
            self.close();
        }
        self.joined.add(&piece);
    }

    fn close(&mut self) {
        let joined = std::mem::take(&mut self.joined);
        if joined.cosine != 0.0 {
            self.done.push(joined.step());
        }
    }

    /// The steps.
    #[must_use]
    pub fn finish(mut self) -> Vec<Step> {
        self.close_piece();
        self.close();
        self.done
    }
}

/// A piece of a drive in one sense of travel.
#[derive(Clone, Debug, PartialEq)]
pub struct Window {
    /// Begin.
    pub start: Time,
    /// End.
    pub end: Time,
    /// What the encoders counted.
    pub steps: Vec<Step>,
    /// Motion of S, in S at the start; the rotation is wrapped.
    pub motion: Pose,
    /// Covariances of the poses of S (x, y, rotation) at the start and at the end, each in S there, from whatever measured
    /// them.
    pub pose_errors: [Matrix3<f64>; 2],
    /// Whether the pose at the start, with its error, is the pose at the end of the window before.
    pub shares_start: bool,
}

impl Window {
    /// Ticks in all, signed.
    #[must_use]
    pub fn ticks(&self) -> f64 {
        self.steps.iter().map(|step| step.ticks).sum()
    }

    /// How the motion answers to errors of the poses at its ends, each in S there.
    fn by_poses(&self) -> [Matrix3<f64>; 2] {
        let motion = &self.motion;
        let (sine, cosine) = motion.theta.sin_cos();
        [
            Matrix3::new(-1.0, 0.0, motion.y, 0.0, -1.0, -motion.x, 0.0, 0.0, -1.0),
            Matrix3::new(cosine, -sine, 0.0, sine, cosine, 0.0, 0.0, 0.0, 1.0),
        ]
    }

    /// Covariance of the measured motion (x, y, rotation).
    #[must_use]
    pub fn covariance(&self) -> Matrix3<f64> {
        let part = |(by, error): (Matrix3<f64>, Matrix3<f64>)| by * error * by.transpose();
        self.by_poses().into_iter().zip(self.pose_errors).map(part).sum()
    }

    /// States the errors of both poses by what they contribute to the covariance of the motion. None if that is singular.
    #[must_use]
    pub fn set_covariance_parts(&mut self, parts: &[Matrix3<f64>; 2]) -> Option<()> {
        let by_poses = self.by_poses();
        for ((error, by), part) in self.pose_errors.iter_mut().zip(by_poses).zip(parts) {
            let inverse = by.try_inverse()?;
            *error = inverse * part * inverse.transpose();
        }
        Some(())
    }

    /// Covariance of the measured motion (rows) with that of the window before (columns).
    #[must_use]
    pub fn covariance_with(&self, before: &Self) -> Matrix3<f64> {
        let roots = (self.pose_errors[0].cholesky(), before.pose_errors[1].cholesky());
        match roots {
            // Both windows state the error of one and the same pose; were the two equal, this would be that error.
            (Some(here), Some(there)) if self.shares_start => {
                self.by_poses()[0] * here.l() * there.l().transpose() * before.by_poses()[1].transpose()
            }
            _ => Matrix3::zeros(),
        }
    }

    /// Whether the vehicle goes backward.
    #[must_use]
    pub fn is_backward(&self) -> bool {
        self.ticks() < 0.0
    }

    /// The measured motion (x, y, rotation), with the rotation among those that look alike that is nearest to `expected`,
    /// rad.
    #[must_use]
    pub fn measured_near(&self, expected: f64) -> Vector3<f64> {
        Vector3::new(self.motion.x, self.motion.y, expected + wrap(self.motion.theta - expected))
    }

    /// The window as the core's closed forms take it, with the steering angles stretched by `steering_ratio`.
    #[must_use]
    pub fn segment(&self, nominal: &Tricycle, steering_ratio: f64) -> Segment {
        let mut builder = SegmentBuilder::new(*nominal);
        for step in &self.steps {
            let steering = step.steering * steering_ratio;
            builder.add_step(step.ticks, steering, steering);
        }
        builder.finish(&self.motion)
    }
}

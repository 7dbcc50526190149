//! A piece of a drive: what the encoders counted, and how the laser moved.

use agv_core::calibration::{Segment, SegmentBuilder};
use agv_core::geometry::{Pose, wrap};
use agv_core::measurement::Time;
use agv_core::odometry::Tricycle;
use nalgebra::Matrix3;

/// Ticks at one steering angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// Ticks of the driving wheel, signed.
    pub ticks: f64,
    /// Steering angle that the nominal scale gives, without offset, rad.
    pub steering: f64,
}

/// Steering angles closer together than this, rad, count as one.
const SAME_STEERING: f64 = 2e-3;

/// Steps of a window as they come, with equal ones joined.
#[derive(Clone, Debug, Default)]
pub struct Steps {
    done: Vec<Step>,
    /// Sums of ticks times sine and cosine of the steering angle.
    sine: f64,
    cosine: f64,
    first: f64,
}

impl Steps {
    /// Adds ticks at a steering angle.
    pub fn add(&mut self, ticks: f64, steering: f64) {
        if ticks == 0.0 {
            return;
        }
        let is_same = self.cosine * ticks > 0.0 && (steering - self.first).abs() < SAME_STEERING;
        if !is_same {
            self.close();
            self.first = steering;
        }
        let (sine, cosine) = steering.sin_cos();
        self.sine += ticks * sine;
        self.cosine += ticks * cosine;
    }

    fn close(&mut self) {
        if self.cosine != 0.0 {
            let sign = self.cosine.signum();
            let steering = (sign * self.sine).atan2(sign * self.cosine);
            self.done.push(Step { ticks: sign * self.sine.hypot(self.cosine), steering });
        }
        (self.sine, self.cosine) = (0.0, 0.0);
    }

    /// The steps.
    #[must_use]
    pub fn finish(mut self) -> Vec<Step> {
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
    /// Covariance of that motion (x, y, rotation), from whatever measured it.
    pub covariance: Matrix3<f64>,
}

impl Window {
    /// Ticks in all, signed.
    #[must_use]
    pub fn ticks(&self) -> f64 {
        self.steps.iter().map(|step| step.ticks).sum()
    }

    /// Whether the vehicle goes backward.
    #[must_use]
    pub fn is_backward(&self) -> bool {
        self.ticks() < 0.0
    }

    /// The rotation of S among those that look alike that is nearest to `expected`, rad.
    #[must_use]
    pub fn rotation_near(&self, expected: f64) -> f64 {
        expected + wrap(self.motion.theta - expected)
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

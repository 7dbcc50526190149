//! Where the encoders say that the laser is.

use agv_core::geometry::{Pose, wrap};
use agv_core::measurement::Time;
use nalgebra::Vector2;

use super::counted::Counted;
use super::model::VehicleModel;
use super::window::Step;

/// The way of R from counters and a model, with the laser on it. It starts in the origin.
#[derive(Clone, Debug)]
pub struct OdometryPath {
    times: Vec<Time>,
    positions: Vec<Vector2<f64>>,
    /// Headings without jumps, rad.
    headings: Vec<f64>,
    laser: Pose,
}

impl OdometryPath {
    /// Integrates the counters, one arc a sample.
    #[must_use]
    pub fn new(counted: &[Counted], model: &VehicleModel) -> Self {
        let (mut position, mut heading) = (Vector2::zeros(), 0.0_f64);
        let mut path = Self {
            times: counted.iter().map(|sample| sample.time).collect(),
            positions: Vec::with_capacity(counted.len()),
            headings: Vec::with_capacity(counted.len()),
            laser: model.laser,
        };
        let mut last: Option<&Counted> = None;
        for sample in counted {
            if let Some(last) = last.replace(sample) {
                let step = Step { ticks: sample.ticks - last.ticks, steering: 0.5 * (last.steering + sample.steering) };
                if step.ticks != 0.0 {
                    let moved = model.motion(&[step]);
                    let (sine, cosine) = heading.sin_cos();
                    position += Vector2::new(cosine * moved.x - sine * moved.y, sine * moved.x + cosine * moved.y);
                    heading += moved.z;
                }
            }
            path.positions.push(position);
            path.headings.push(heading);
        }
        path
    }

    /// Pose of S, in R's first pose, at a time; held at both ends.
    #[must_use]
    pub fn laser_at(&self, time: Time) -> Pose {
        self.robot_at(time).compose(&self.laser)
    }

    /// Pose of R, in R's first pose, at a time; held at both ends.
    #[must_use]
    pub fn robot_at(&self, time: Time) -> Pose {
        let after = self.times.partition_point(|sample| *sample <= time);
        let Some(before) = after.checked_sub(1) else {
            return Pose::default();
        };
        let at = |index: usize| (self.positions[index], self.headings[index]);
        let (mut position, mut heading) = at(before);
        if after < self.times.len() {
            let (next, next_heading) = at(after);
            let share = time.since(self.times[before]) / self.times[after].since(self.times[before]);
            position += (next - position) * share;
            heading += (next_heading - heading) * share;
        }
        Pose { x: position.x, y: position.y, theta: wrap(heading) }
    }
}

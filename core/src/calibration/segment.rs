//! One segment of a calibration drive as sums.

use nalgebra::Vector2;

use super::arc::{Arc, arc};
use crate::geometry::{Pose, wrap};
use crate::measurement::EncoderSample;
use crate::odometry::{Control, Integration, Tricycle};

/// A segment in one sense of travel. Steering angles are as measured, without offset.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Segment {
    /// Sum of ticks times the sine of the steering angle (K 2.7), ticks.
    pub sine: f64,
    /// Sum of ticks times the cosine of the steering angle (K 2.7), ticks; negative backward.
    pub cosine: f64,
    /// Where the nominal vehicle ends, minus the end of its arc of constant steering with the same sums, in R at the
    /// start, m. Zero if the steering angle is constant.
    pub bend: Vector2<f64>,
    /// Where S ends, in S at the start, m (K: s_x, s_y).
    pub sensor: Vector2<f64>,
    /// Rotation of S, rad, not wrapped (K: s_theta).
    pub rotation: f64,
}

impl Segment {
    /// Whether the vehicle goes backward.
    #[must_use]
    pub fn is_backward(&self) -> bool {
        self.cosine < 0.0
    }

    /// Whether all values are finite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        [self.sine, self.cosine, self.bend.x, self.bend.y, self.sensor.x, self.sensor.y, self.rotation]
            .iter()
            .all(|value| value.is_finite())
    }

    /// Where R ends, in R at the start, with its derivatives: the arc, and what the nominal integration adds to it.
    pub(super) fn arc(&self, offset: f64, turn_scale: f64, wheelbase: f64) -> Arc {
        let arc = arc(self.sine, self.cosine, offset, turn_scale, wheelbase);
        Arc { position: arc.position + self.bend, ..arc }
    }

    /// The rotation that the encoders claim, rad (K 2.8), for an offset (rad) and a turn scale (rad for a tick).
    #[must_use]
    pub fn turned(&self, offset: f64, turn_scale: f64) -> f64 {
        let (sine, cosine) = libm::sincos(offset);
        turn_scale * (self.sine * cosine + self.cosine * sine)
    }
}

/// Makes the sums of one segment. The offsets and the scale of the nominal vehicle matter only where the steering changes
/// within a segment, and for the turns of the rotation.
#[derive(Clone, Debug)]
pub struct SegmentBuilder {
    nominal: Tricycle,
    last: Option<EncoderSample>,
    sine: f64,
    cosine: f64,
    position: Vector2<f64>,
    heading: f64,
}

impl SegmentBuilder {
    /// A segment that has seen nothing.
    #[must_use]
    pub const fn new(nominal: Tricycle) -> Self {
        Self { nominal, last: None, sine: 0.0, cosine: 0.0, position: Vector2::new(0.0, 0.0), heading: 0.0 }
    }

    /// Takes the next sample of the encoders.
    pub fn add(&mut self, sample: &EncoderSample) {
        let tricycle = &self.nominal;
        if let Some(last) = self.last.replace(*sample) {
            let ticks = tricycle.drive_range.step(last.drive, sample.drive) as f64;
            let angle = |reading: u32| tricycle.steering_scale * tricycle.steering_range.signed(reading) as f64;
            self.add_step(ticks, angle(last.steering), angle(sample.steering));
        }
    }

    /// Takes ticks of the driving wheel while the steering angle goes from `start` to `end`, rad as measured.
    pub fn add_step(&mut self, ticks: f64, start: f64, end: f64) {
        if ticks == 0.0 {
            return;
        }
        let (sine, cosine) = libm::sincos(0.5 * (start + end));
        self.sine += ticks * sine;
        self.cosine += ticks * cosine;
        let tricycle = &self.nominal;
        let offset = self.offset(ticks < 0.0);
        let control = Control {
            distance: tricycle.drive_scale * ticks,
            steering_start: start + offset,
            steering_end: end + offset,
        };
        let step = control.displacement(tricycle.wheelbase, Integration::Arc);
        let (heading_sine, heading_cosine) = libm::sincos(self.heading);
        self.position += Vector2::new(
            heading_cosine * step.x - heading_sine * step.y,
            heading_sine * step.x + heading_cosine * step.y,
        );
        // Not the step's own rotation, which is wrapped.
        self.heading += control.distance / tricycle.wheelbase * libm::sin(0.5 * (start + end) + offset);
    }

    fn offset(&self, is_backward: bool) -> f64 {
        let tricycle = &self.nominal;
        if is_backward { tricycle.steering_offset_backward } else { tricycle.steering_offset_forward }
    }

    /// Begins a new segment behind the last sample and gives the one that is done.
    pub(super) fn restart(&mut self) -> Self {
        let next = Self { last: self.last, ..Self::new(self.nominal) };
        core::mem::replace(self, next)
    }

    /// Where the nominal vehicle is, in R at the start; the heading is wrapped.
    #[must_use]
    pub fn nominal_pose(&self) -> Pose {
        Pose::new(self.position.x, self.position.y, self.heading)
    }

    /// Whether the driving wheel has moved.
    #[must_use]
    pub fn has_moved(&self) -> bool {
        self.sine != 0.0 || self.cosine != 0.0
    }

    /// The segment, given the motion of S between its ends, in S at its start. Of the rotations that look alike the one
    /// nearest to the nominal vehicle's is taken.
    #[must_use]
    pub fn finish(&self, sensor: &Pose) -> Segment {
        let tricycle = &self.nominal;
        let offset = self.offset(self.cosine < 0.0);
        let turn_scale = tricycle.drive_scale / tricycle.wheelbase;
        let smooth = arc(self.sine, self.cosine, offset, turn_scale, tricycle.wheelbase);
        Segment {
            sine: self.sine,
            cosine: self.cosine,
            bend: self.position - smooth.position,
            sensor: Vector2::new(sensor.x, sensor.y),
            rotation: self.heading + wrap(sensor.theta - self.heading),
        }
    }
}

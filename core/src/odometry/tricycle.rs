//! A tricycle whose front wheel steers and drives.

use serde::{Deserialize, Serialize};

use super::counter::ticks_as_f64;
use super::kinematics::{Believed, Kinematics, Step};
use super::{AngleEncoder, Contact, Control, CounterRange, Wheel};
use crate::measurement::{EncoderSample, Time};

/// A tricycle whose front wheel steers and drives (K 2.1.1), with one steering offset for each direction of travel
/// (K 2.1.2); the standard model is the one in which both are equal. It reports two counters.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tricycle {
    /// Distance from the rear axle to the driving wheel's steering axis, m (K: L).
    pub wheelbase: f64,
    /// Distance travelled by the driving wheel for one tick, m (K: s_w).
    pub drive_scale: f64,
    /// Range of the driving wheel's counter.
    pub drive_range: CounterRange,
    /// Steering angle for one tick, rad.
    pub steering_scale: f64,
    /// Range of the steering counter; readings in its upper half are negative angles.
    pub steering_range: CounterRange,
    /// What is added to the measured steering angle while driving forward, rad (K 2.6: alpha_F).
    pub steering_offset_forward: f64,
    /// What is added to the measured steering angle while driving backward, rad (K 2.6: alpha_B).
    pub steering_offset_backward: f64,
}

impl Kinematics for Tricycle {
    type Report = EncoderSample;

    fn time(report: &EncoderSample) -> Time {
        report.time
    }

    fn is_sound(&self, _: &EncoderSample) -> bool {
        true
    }

    fn step(&self, from: &EncoderSample, to: &EncoderSample, duration: f64, believed: &Believed) -> Step {
        let ticks = self.drive_range.step(from.drive, to.drive);
        // A counter that counts the wrong way has a negative scale.
        let is_backward = if ticks == 0 { believed.was_backward } else { (ticks < 0) != (self.drive_scale < 0.0) };
        let offset = if is_backward { self.steering_offset_backward } else { self.steering_offset_forward };
        let angle = |reading: i64| self.steering_scale * ticks_as_f64(reading) + offset;
        // The wheel may pass the end of the counter's range.
        let start = self.steering_range.signed(from.steering);
        let end = start + self.steering_range.step(from.steering, to.steering);
        let control = Control {
            distance: self.drive_scale * ticks_as_f64(ticks),
            steering_start: angle(start),
            steering_end: angle(end),
        };
        Step { is_backward, ..control.step(self.wheelbase, duration, believed) }
    }

    fn steering_lever(&self) -> Option<f64> {
        Some(self.wheelbase)
    }

    /// At its fastest the vehicle may go half of the counter's range; beyond, it may seem to go the other way.
    fn longest_interval(&self, fastest: f64) -> f64 {
        0.5 * self.drive_range.values() as f64 * libm::fabs(self.drive_scale) / fastest
    }

    fn resolution(&self) -> Option<f64> {
        Some(libm::fabs(self.drive_scale))
    }
}

impl Tricycle {
    /// The same vehicle as wheels of the general model, while it drives forward: the driving wheel, and one that carries on the
    /// rear axle. The wheel has the radius 1 m and turns by [`Self::drive_scale`] for a tick.
    #[must_use]
    pub const fn wheels(&self) -> [Wheel; 2] {
        let turn = AngleEncoder { scale: self.drive_scale, range: self.drive_range };
        let steering = AngleEncoder { scale: self.steering_scale, range: self.steering_range };
        let rear =
            Wheel { x: 0.0, y: 0.0, heading: 0.0, radius: 1.0, contact: Contact::Tyre, turn: None, steering: None };
        let heading = self.steering_offset_forward;
        [Wheel { x: self.wheelbase, heading, turn: Some(turn), steering: Some(steering), ..rear }, rear]
    }
}

//! From samples to motions.

use core::f64::consts::PI;

use super::{Control, Integration, Motion, OdometryNoise, Tricycle, Vehicle};
use crate::measurement::{EncoderSample, PoseIncrement, SpeedSample, Time};

/// Why a sample gave no motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OdometryError {
    /// It is the first one, so there is nothing to compare it with.
    First,
    /// It is not later than the one before.
    OutOfOrder,
    /// The vehicle, as it is described, does not send such samples.
    WrongVehicle,
    /// The vehicle cannot be that fast, or a value is not finite.
    Implausible,
    /// So long after the one before that nobody knows what the vehicle did meanwhile, or how often its counter wrapped.
    Pause,
}

/// Turns samples into motions; remembers the last sample only.
#[derive(Clone, Debug)]
pub struct Odometer {
    vehicle: Vehicle,
    noise: OdometryNoise,
    integration: Integration,
    fastest: f64,
    longest_interval: f64,
    last: Option<Sample>,
}

#[derive(Clone, Copy, Debug)]
enum Sample {
    Encoders { sample: EncoderSample, backward: bool },
    Speed(SpeedSample),
    Increment(Time),
}

impl Tricycle {
    fn control(&self, from: &EncoderSample, to: &EncoderSample, was_backward: bool) -> (Control, bool) {
        let ticks = self.drive_range.step(from.drive, to.drive);
        let backward = if ticks == 0 { was_backward } else { ticks < 0 };
        let offset = if backward { self.steering_offset_backward } else { self.steering_offset_forward };
        let angle = |reading: u32| self.steering_scale * self.steering_range.signed(reading) as f64 + offset;
        let control = Control {
            distance: self.drive_scale * ticks as f64,
            steering_start: angle(from.steering),
            steering_end: angle(to.steering),
        };
        (control, backward)
    }
}

impl Odometer {
    /// An odometer that has seen no sample. Motions faster than `fastest` (m/s) or longer than `longest_interval` (s) are
    /// refused.
    #[must_use]
    pub fn new(
        vehicle: Vehicle,
        noise: OdometryNoise,
        integration: Integration,
        fastest: f64,
        longest_interval: f64,
    ) -> Self {
        let longest_interval = match &vehicle {
            // At its fastest the vehicle may go half of the counter's range; beyond, it may seem to go the other way.
            Vehicle::Tricycle(tricycle) => {
                let half = 0.5 * tricycle.drive_range.values() as f64 * libm::fabs(tricycle.drive_scale);
                longest_interval.min(half / fastest)
            }
            Vehicle::Ackermann(_) | Vehicle::Increments => longest_interval,
        };
        Self { vehicle, noise, integration, fastest, longest_interval, last: None }
    }

    /// The vehicle whose samples it takes.
    #[must_use]
    pub fn vehicle(&self) -> &Vehicle {
        &self.vehicle
    }

    /// Forgets the last sample: what comes next cannot be compared with it.
    pub fn restart(&mut self) {
        self.last = None;
    }

    /// The motion since the last sample of the two counters.
    ///
    /// # Errors
    /// See [`OdometryError`]; a refused step is not made up for later, except that the counters go on from it.
    pub fn encoders(&mut self, sample: &EncoderSample) -> Result<Motion, OdometryError> {
        let Vehicle::Tricycle(tricycle) = self.vehicle else {
            return Err(OdometryError::WrongVehicle);
        };
        let Some(Sample::Encoders { sample: last, backward }) = self.last else {
            self.last = Some(Sample::Encoders { sample: *sample, backward: false });
            return Err(OdometryError::First);
        };
        if sample.time <= last.time {
            return Err(OdometryError::OutOfOrder);
        }
        let (control, backward) = tricycle.control(&last, sample, backward);
        self.last = Some(Sample::Encoders { sample: *sample, backward });
        self.motion(last.time, sample.time, &control, tricycle.wheelbase)
    }

    /// The motion since the last sample of speed and steering angle; the speed changes linearly between samples.
    ///
    /// # Errors
    /// See [`OdometryError`].
    pub fn speed(&mut self, sample: &SpeedSample) -> Result<Motion, OdometryError> {
        let Vehicle::Ackermann(car) = self.vehicle else {
            return Err(OdometryError::WrongVehicle);
        };
        if !(sample.speed.is_finite() && libm::fabs(sample.steering) < core::f64::consts::FRAC_PI_2) {
            return Err(OdometryError::Implausible);
        }
        let Some(Sample::Speed(last)) = self.last else {
            self.last = Some(Sample::Speed(*sample));
            return Err(OdometryError::First);
        };
        if sample.time <= last.time {
            return Err(OdometryError::OutOfOrder);
        }
        self.last = Some(Sample::Speed(*sample));
        let duration = sample.time.since(last.time);
        let wheel_speed = |sample: &SpeedSample| {
            let (sine, cosine) = libm::sincos(sample.steering);
            sample.speed / (cosine - sine * car.encoder_offset / car.wheelbase)
        };
        let control = Control {
            distance: 0.5 * (wheel_speed(&last) + wheel_speed(sample)) * duration,
            steering_start: last.steering,
            steering_end: sample.steering,
        };
        self.motion(last.time, sample.time, &control, car.wheelbase)
    }

    /// The motion that the vehicle has integrated itself.
    ///
    /// # Errors
    /// See [`OdometryError`].
    pub fn increment(&mut self, increment: &PoseIncrement) -> Result<Motion, OdometryError> {
        if self.vehicle != Vehicle::Increments {
            return Err(OdometryError::WrongVehicle);
        }
        let last = self.last.replace(Sample::Increment(increment.time));
        let Some(Sample::Increment(start)) = last else {
            return Err(OdometryError::First);
        };
        if increment.time <= start {
            self.last = last;
            return Err(OdometryError::OutOfOrder);
        }
        let duration = increment.time.since(start);
        // Increments that were lost meanwhile are not in it.
        if duration > self.longest_interval {
            return Err(OdometryError::Pause);
        }
        let distance = libm::hypot(increment.displacement.x, increment.displacement.y);
        // Half a turn either way is all that a heading can say.
        let is_turn = libm::fabs(increment.displacement.theta) <= PI;
        if !(increment.displacement.is_finite() && is_turn) || distance > self.fastest * duration {
            return Err(OdometryError::Implausible);
        }
        Ok(Motion {
            start,
            end: increment.time,
            displacement: increment.displacement,
            covariance: self.noise.of_displacement(distance, duration),
            distance,
        })
    }

    fn motion(&self, start: Time, end: Time, control: &Control, wheelbase: f64) -> Result<Motion, OdometryError> {
        let duration = end.since(start);
        if duration > self.longest_interval {
            return Err(OdometryError::Pause);
        }
        let distance = libm::fabs(control.distance);
        if distance.is_nan() || distance > self.fastest * duration {
            return Err(OdometryError::Implausible);
        }
        let displacement = control.displacement(wheelbase, self.integration);
        let covariance = self.noise.of_control(control, wheelbase, duration);
        if !(displacement.is_finite() && covariance.iter().all(|entry| entry.is_finite())) {
            return Err(OdometryError::Implausible);
        }
        Ok(Motion { start, end, displacement, covariance, distance })
    }
}

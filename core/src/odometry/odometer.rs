//! From reports to motions.

use serde::{Deserialize, Serialize};

use super::kinematics::Believed;
use super::{Increments, Integration, Kinematics, Motion, OdometryNoise, Vehicle, WheelBased, WheelSet};
use crate::measurement::{EncoderSample, PoseIncrement, SpeedSample, Time, WheelSample};

/// Why a report gave no motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OdometryError {
    /// It is the first one, so there is nothing to compare it with.
    First,
    /// It is not later than the one before.
    OutOfOrder,
    /// The vehicle, as it is described, does not send such reports.
    WrongVehicle,
    /// The vehicle cannot be that fast, or a value is not finite.
    Implausible,
    /// So long after the one before that nobody knows what the vehicle did meanwhile, or how often its counter wrapped.
    Pause,
}

/// What an odometer believes, whatever the vehicle.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct OdometerParameters {
    /// How wrong the reports may be.
    pub noise: OdometryNoise,
    /// How they are integrated.
    pub integration: Integration,
    /// Motions faster than this, m/s, are refused.
    pub fastest: f64,
    /// Reports further apart than this, s, make no motion.
    pub longest_interval: f64,
}

/// Turns the reports of a vehicle into motions; remembers the last report only.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(bound(
    serialize = "K: Serialize, K::Report: Serialize",
    deserialize = "K: Deserialize<'de>, K::Report: Deserialize<'de>"
))]
pub struct Odometer<K: Kinematics> {
    kinematics: K,
    parameters: OdometerParameters,
    last: Option<K::Report>,
    was_backward: bool,
    interval: MeanInterval,
    /// How much further the vehicle may have gone by now, m.
    margin: Option<f64>,
    /// The largest step that was possible when one was refused as implausible, m.
    refused: f64,
    /// Reports in a row that are not later than the last one, and the newest of them.
    earlier: (u8, Time),
}

/// After so many reports in a row that follow each other but are not later than the one before, that one had a wrong time.
const MOST_EARLIER: u8 = 10;

/// The mean time between two reports, of about the last sixteen, s.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
struct MeanInterval {
    mean: f64,
    count: u8,
}

impl MeanInterval {
    const MEMORY: u8 = 16;

    /// Takes the next one; gives the mean with it.
    fn add(&mut self, duration: f64) -> f64 {
        self.count = Self::MEMORY.min(self.count.saturating_add(1));
        self.mean += (duration - self.mean) / f64::from(self.count);
        self.mean
    }
}

impl<K: Kinematics> Odometer<K> {
    /// An odometer that has seen no report.
    #[must_use]
    pub fn new(kinematics: K, parameters: &OdometerParameters) -> Self {
        let longest_interval = parameters.longest_interval.min(kinematics.longest_interval(parameters.fastest));
        let parameters = OdometerParameters { longest_interval, ..*parameters };
        let (interval, earlier) = (MeanInterval::default(), (0, Time::default()));
        Self { kinematics, parameters, last: None, was_backward: false, interval, margin: None, refused: 0.0, earlier }
    }

    /// Forgets the last report: what comes next cannot be compared with it.
    pub fn restart(&mut self) {
        self.last = None;
    }

    /// How far the vehicle may have gone in the step that was refused last, m.
    #[must_use]
    pub const fn refused(&self) -> f64 {
        self.refused
    }

    /// How far the vehicle can have gone in a step of that duration, m.
    ///
    /// Where the times of two reports are off, the step holds the way of the mean time between reports instead of that between the two,
    /// but not one step after the other: what was gone is taken from the margin. A tick more may fall into any step.
    fn longest_step(&mut self, duration: f64, interval: f64) -> f64 {
        let fastest = self.parameters.fastest;
        let Some(tick) = self.kinematics.resolution() else { return fastest * duration };
        let most = fastest * duration.max(interval);
        let margin = self.margin.map_or(most, |margin| (margin + fastest * duration).min(most));
        self.margin = Some(margin);
        margin + tick
    }

    /// Whether a report that is not later than the last one shows that it was the last one whose time was wrong.
    fn is_clock_behind(&mut self, time: Time) -> bool {
        let (count, newest) = self.earlier;
        self.earlier = (if count > 0 && time <= newest { 1 } else { count.saturating_add(1) }, time);
        self.earlier.0 >= MOST_EARLIER
    }

    /// The motion since the last report.
    ///
    /// # Errors
    /// See [`OdometryError`]; a refused step is not made up for later, except that the reports go on from it.
    pub fn report(&mut self, report: &K::Report) -> Result<Motion, OdometryError> {
        self.report_with_slip(report).map(|(motion, _)| motion)
    }

    /// The motion since the last report, and what redundant wheels say differently of it, m ([`super::Step::slip`]).
    ///
    /// # Errors
    /// As [`Self::report`].
    pub fn report_with_slip(&mut self, report: &K::Report) -> Result<(Motion, f64), OdometryError> {
        if !self.kinematics.is_sound(report) {
            return Err(OdometryError::Implausible);
        }
        let Some(last) = self.last else {
            (self.last, self.was_backward) = (Some(*report), false);
            return Err(OdometryError::First);
        };
        let (start, end) = (K::time(&last), K::time(report));
        if end <= start {
            if self.is_clock_behind(end) {
                (self.last, self.earlier.0) = (Some(*report), 0);
            }
            return Err(OdometryError::OutOfOrder);
        }
        self.earlier.0 = 0;
        self.last = Some(*report);
        let OdometerParameters { noise, integration, longest_interval, .. } = self.parameters;
        let duration = end.since(start);
        let believed = Believed { noise, integration, was_backward: self.was_backward };
        let step = self.kinematics.step(&last, report, duration, &believed);
        self.was_backward = step.is_backward;
        // What was lost meanwhile is not in it.
        if duration > longest_interval {
            return Err(OdometryError::Pause);
        }
        let interval = self.interval.add(duration);
        let is_finite = step.displacement.is_finite() && step.covariance.iter().all(|entry| entry.is_finite());
        let longest = self.longest_step(duration, interval);
        if step.distance.is_nan() || step.distance > longest || !is_finite {
            self.refused = longest;
            return Err(OdometryError::Implausible);
        }
        self.margin = self.margin.map(|margin| margin - step.distance);
        let (displacement, covariance, distance) = (step.displacement, step.covariance, step.distance);
        Ok((Motion { start, end, displacement, covariance, distance }, step.slip))
    }
}

/// The odometer of any vehicle that the parameters can describe.
#[expect(clippy::large_enum_variant, reason = "there is no heap, and one such value in a localizer")]
#[derive(Clone, Debug, Serialize, Deserialize)]
pub enum VehicleOdometer {
    /// See [`super::Tricycle`].
    Tricycle(Odometer<super::Tricycle>),
    /// See [`super::Ackermann`].
    Ackermann(Odometer<super::Ackermann>),
    /// See [`Increments`].
    Increments(Odometer<Increments>),
    /// See [`WheelSet`].
    Wheels(Odometer<WheelSet>),
    /// See [`super::TricycleSpeed`].
    TricycleSpeed(Odometer<super::TricycleSpeed>),
}

impl VehicleOdometer {
    /// An odometer that has seen no report.
    #[must_use]
    pub fn new(vehicle: &Vehicle, parameters: &OdometerParameters) -> Self {
        match vehicle {
            Vehicle::Tricycle(tricycle) => Self::Tricycle(Odometer::new(*tricycle, parameters)),
            Vehicle::Ackermann(car) => Self::Ackermann(Odometer::new(*car, parameters)),
            Vehicle::Increments => Self::Increments(Odometer::new(Increments, parameters)),
            Vehicle::Wheels(vehicle) => {
                Self::Wheels(Odometer::new(WheelSet::of(vehicle.wheels().as_ref()), parameters))
            }
            Vehicle::TricycleSpeed(tricycle) => Self::TricycleSpeed(Odometer::new(*tricycle, parameters)),
        }
    }

    /// Forgets the last report: what comes next cannot be compared with it.
    pub fn restart(&mut self) {
        match self {
            Self::Tricycle(odometer) => odometer.restart(),
            Self::Ackermann(odometer) => odometer.restart(),
            Self::Increments(odometer) => odometer.restart(),
            Self::Wheels(odometer) => odometer.restart(),
            Self::TricycleSpeed(odometer) => odometer.restart(),
        }
    }

    /// See [`Kinematics::resolution`], m; zero without one.
    #[must_use]
    pub fn resolution(&self) -> f64 {
        let resolution = match self {
            Self::Tricycle(odometer) => odometer.kinematics.resolution(),
            Self::Ackermann(odometer) => odometer.kinematics.resolution(),
            Self::Increments(odometer) => odometer.kinematics.resolution(),
            Self::Wheels(odometer) => odometer.kinematics.resolution(),
            Self::TricycleSpeed(odometer) => odometer.kinematics.resolution(),
        };
        resolution.unwrap_or_default()
    }

    /// See [`Odometer::refused`].
    #[must_use]
    pub const fn refused(&self) -> f64 {
        match self {
            Self::Tricycle(odometer) => odometer.refused(),
            Self::Ackermann(odometer) => odometer.refused(),
            Self::Increments(odometer) => odometer.refused(),
            Self::Wheels(odometer) => odometer.refused(),
            Self::TricycleSpeed(odometer) => odometer.refused(),
        }
    }

    /// The motion since the last sample of the two counters.
    ///
    /// # Errors
    /// See [`Odometer::report`].
    pub fn encoders(&mut self, sample: &EncoderSample) -> Result<Motion, OdometryError> {
        match self {
            Self::Tricycle(odometer) => odometer.report(sample),
            _ => Err(OdometryError::WrongVehicle),
        }
    }

    /// The motion since the last sample of speed and steering angle.
    ///
    /// # Errors
    /// See [`Odometer::report`].
    pub fn speed(&mut self, sample: &SpeedSample) -> Result<Motion, OdometryError> {
        match self {
            Self::Ackermann(odometer) => odometer.report(sample),
            Self::TricycleSpeed(odometer) => odometer.report(sample),
            _ => Err(OdometryError::WrongVehicle),
        }
    }

    /// The motion since the last sample of several wheels.
    ///
    /// # Errors
    /// See [`Odometer::report`].
    pub fn wheels(&mut self, sample: &WheelSample) -> Result<Motion, OdometryError> {
        self.wheels_with_slip(sample).map(|(motion, _)| motion)
    }

    /// The motion since the last sample of several wheels, and what redundant ones say differently of it.
    ///
    /// # Errors
    /// See [`Odometer::report_with_slip`].
    pub fn wheels_with_slip(&mut self, sample: &WheelSample) -> Result<(Motion, f64), OdometryError> {
        match self {
            Self::Wheels(odometer) => odometer.report_with_slip(sample),
            _ => Err(OdometryError::WrongVehicle),
        }
    }

    /// The motion that the vehicle has integrated itself.
    ///
    /// # Errors
    /// See [`Odometer::report`].
    pub fn increment(&mut self, increment: &PoseIncrement) -> Result<Motion, OdometryError> {
        match self {
            Self::Increments(odometer) => odometer.report(increment),
            _ => Err(OdometryError::WrongVehicle),
        }
    }
}

//! The pose for now, while the localiser is still busy with what was true a little earlier.
//!
//! A scan takes the localiser longer than an encoder sample may wait. So the samples wait for the localiser, and this
//! carries its last pose on by them at once: the output predictor of PX4's EKF2 and others, here without states of its
//! own, as the pose is all that is published.

use heapless::Vec;
use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};

use super::{Parameters, PredictionState};
use crate::filter::Ekf;
use crate::geometry::Twist;
use crate::integrity::separation::fault_free;
use crate::measurement::{EncoderFaults, EncoderSample, GyroSample, PoseIncrement, SpeedSample, Time, WheelSample};
use crate::odometry::{
    Coasting, GyroTurns, MeanMotion, Motion, OdometryError, StandingWheels, UnknownAcceleration, VehicleOdometer,
};
use crate::state::{Mode, PoseOutput, ProtectionLevel, Reason};

/// Longest time, s, for which a localiser that says nothing is merely busy: the longest scan, twice.
const LONGEST_BUSY: f64 = 0.25;

/// Carries the localiser's last pose on to the newest encoder sample. Remembers all motion since, in `MOTIONS` parts: if
/// there are more samples, neighbours become one, and a pose of the localiser that falls between them is met as if the
/// vehicle had kept its velocity for that time.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct OutputPredictor<const MOTIONS: usize = 40> {
    odometer: VehicleOdometer,
    lever: Option<f64>,
    dead_reckoning_from: f64,
    motions: Vec<Motion, MOTIONS>,
    base: Option<PoseOutput>,
    state: Ekf,
    prediction: PredictionState,
    /// Of a vehicle with a gyro.
    gyro: Option<GyroTurns>,
    wheels: StandingWheels,
    /// How fast it goes.
    recent: MeanMotion,
    /// While the odometry does not report how.
    coasting: Option<Coasting>,
    unknown: UnknownAcceleration,
    faults: EncoderFaults,
}

impl<const MOTIONS: usize> OutputPredictor<MOTIONS> {
    /// A predictor for the vehicle of a localiser with these parameters.
    #[must_use]
    pub fn new(parameters: &Parameters) -> Self {
        Self {
            odometer: VehicleOdometer::new(&parameters.vehicle, &parameters.odometer()),
            lever: parameters.vehicle.steering_lever(),
            dead_reckoning_from: parameters.limits.dead_reckoning_from,
            motions: Vec::new(),
            base: None,
            state: Ekf::new(crate::geometry::Pose::default(), 0.0, 0.0),
            prediction: PredictionState::default(),
            gyro: parameters.uses_gyro().then(|| GyroTurns::new(&parameters.gyro)),
            wheels: StandingWheels::new(),
            recent: MeanMotion::NONE,
            coasting: None,
            unknown: UnknownAcceleration::of(&parameters.vehicle, &parameters.odometry_noise),
            faults: EncoderFaults::default(),
        }
    }

    /// Takes what the localiser said last, and what it has learnt of the motion.
    pub fn update(&mut self, output: &PoseOutput, prediction: &PredictionState) {
        self.prediction = *prediction;
        self.motions.retain(|motion| motion.end > output.time);
        self.base = Some(*output);
        let [xx, xy, yy, x_heading, y_heading, heading] = output.covariance;
        let covariance = Matrix3::new(xx, xy, x_heading, xy, yy, y_heading, x_heading, y_heading, heading);
        self.state = Ekf::with_covariance(output.pose, &covariance);
        for motion in &self.motions {
            predict(&mut self.state, &motion.corrected(&prediction.bias, self.lever), output.time);
        }
    }

    /// How fast the vehicle goes: the velocity of R along its axes, m/s, m/s and rad/s, and until when it is the mean of about a tenth of a
    /// second. None before it has moved, and while nobody reports how it moves.
    #[must_use]
    pub fn velocity(&self) -> Option<(Time, Twist)> {
        let velocity = self.recent.velocity();
        let Motion { end, start, .. } = self.recent.motion();
        let is_told = end > start && self.coasting.is_none() && !self.faults.any();
        is_told.then_some((end, Twist { x: velocity.x, y: velocity.y, theta: velocity.z }))
    }

    /// Takes a reading of the gyro, at once when it is heard.
    pub fn gyro(&mut self, sample: &GyroSample) {
        if let Some(gyro) = &mut self.gyro {
            // What tells no turn is left to the wheels.
            let _ = gyro.sample(sample);
        }
    }

    /// The motion with the turn of the gyro, if there is one.
    fn by_gyro(&mut self, motion: &Motion) -> Motion {
        let Some((gyro, errors)) = self.gyro.as_mut().zip(self.prediction.gyro) else { return *motion };
        let stands = self.wheels.add(motion);
        match gyro.turn(motion.start, motion.end).filter(|_| !stands) {
            Some(turn) => motion.with_turn(turn.corrected(&errors), turn.variance),
            None => *motion,
        }
    }

    /// Takes a sample of the encoders, at once when it is heard.
    pub fn encoders(&mut self, sample: &EncoderSample) {
        let motion = self.odometer.encoders(sample);
        self.travel(sample.time, motion);
    }

    /// The same of the encoders of several wheels.
    pub fn wheels(&mut self, sample: &WheelSample) {
        let motion = self.odometer.wheels(sample);
        self.travel(sample.time, motion);
    }

    /// The same of speed and steering angle.
    pub fn speed(&mut self, sample: &SpeedSample) {
        let motion = self.odometer.speed(sample);
        self.travel(sample.time, motion);
    }

    /// The same of a motion that the vehicle has integrated itself.
    pub fn increment(&mut self, increment: &PoseIncrement) {
        let motion = self.odometer.increment(increment);
        self.travel(increment.time, motion);
    }

    fn travel(&mut self, time: Time, motion: Result<Motion, OdometryError>) {
        self.faults = EncoderFaults::default();
        match motion {
            Ok(motion) => {
                self.coasting = None;
                let motion = if self.gyro.is_some() { self.by_gyro(&motion) } else { motion };
                self.recent.add(&motion);
                self.go_on(motion);
            }
            Err(OdometryError::Pause | OdometryError::Implausible) => self.coast(time),
            // The first report behind a fault.
            Err(OdometryError::First) if self.coasting.is_some() => self.coast(time),
            Err(_) => {}
        }
    }

    /// Goes on to `time` as it has gone before, as the odometry does not report how.
    fn coast(&mut self, time: Time) {
        let recent = self.recent.motion();
        // Of a pose that nobody knows, and a vehicle that was never heard to move, there is nothing to carry on.
        let is_unknown = self.base.is_none_or(|base| base.mode == Mode::NotLocalised);
        if is_unknown && recent.end <= recent.start {
            return;
        }
        let coasting = self.coasting.get_or_insert_with(|| Coasting::new(recent));
        if let Some(motion) = coasting.to(time, &self.unknown) {
            self.go_on(motion);
        }
    }

    fn go_on(&mut self, motion: Motion) {
        if self.motions.is_full() {
            self.join_shortest();
        }
        // There is room.
        let _ = self.motions.push(motion);
        if let Some(base) = self.base.filter(|base| motion.end > base.time) {
            let motion = motion.corrected(&self.prediction.bias, self.lever);
            predict(&mut self.state, &motion, base.time);
        }
    }

    /// Makes one motion of the two neighbours that together take the least time.
    fn join_shortest(&mut self) {
        let duration = |index: usize| match self.motions.get(index..index + 2) {
            Some([first, second]) => second.end.since(first.start),
            _ => f64::INFINITY,
        };
        let pairs = 0..self.motions.len().saturating_sub(1);
        let Some(index) = pairs.min_by(|a, b| duration(*a).total_cmp(&duration(*b))) else { return };
        // Those behind the pair move up, and push its second out.
        let Some(mut second) = self.motions.pop() else { return };
        for place in self.motions.iter_mut().skip(index + 1).rev() {
            core::mem::swap(place, &mut second);
        }
        if let Some(first) = self.motions.get_mut(index) {
            *first = first.then(&second);
        }
    }

    /// Takes what is wrong with the encoders, at once when it is known.
    pub fn doubt_encoders(&mut self, faults: &EncoderFaults) {
        self.faults = *faults;
        if faults.any() {
            self.odometer.restart();
            self.coast(faults.time);
        }
    }

    /// Whether the localiser has said anything.
    #[must_use]
    pub fn has_output(&self) -> bool {
        self.base.is_some()
    }

    /// The pose for now. None before the localiser has said anything. What rests on landmarks that the localiser has used
    /// too long ago is dead reckoning, even if it has no time to say so.
    #[must_use]
    pub fn output(&self) -> Option<PoseOutput> {
        let base = self.base?;
        let newest = self.motions.last().filter(|motion| motion.end > base.time);
        let travelled: f64 =
            self.motions.iter().filter(|motion| motion.end > base.time).map(|motion| motion.distance).sum();
        let is_localised = !matches!(base.mode, Mode::NotLocalised | Mode::Lost);
        let time = newest.map_or(base.time, |motion| motion.end);
        let distance = base.dead_reckoning_distance + travelled;
        let is_reckoned =
            base.mode.is_localised() && (time.since(base.time) > LONGEST_BUSY || distance > self.dead_reckoning_from);
        let (mode, reason) = match (is_localised, self.faults.drive, self.faults.steering) {
            (true, Some(_), _) => (Mode::WithoutOdometry, Reason::DriveEncoder),
            (true, None, Some(_)) => (Mode::WithoutOdometry, Reason::SteeringEncoder),
            _ if is_reckoned => (Mode::DeadReckoning, Reason::NoLandmarks),
            _ => (base.mode, base.reason),
        };
        Some(PoseOutput {
            time,
            pose: self.state.pose,
            smooth: base.smooth.compose(&base.pose.between(&self.state.pose)),
            covariance: self.state.covariance_entries(),
            level: self.level(&base, travelled, time.since(base.time)),
            mode,
            reason,
            dead_reckoning_distance: distance,
            ..base
        })
    }

    /// That of the localiser's pose, grown with what the pose is less sure of, and with the heading's share in the distance since; or as the
    /// localiser expects it to grow.
    fn level(&self, base: &PoseOutput, travelled: f64, passed: f64) -> ProtectionLevel {
        let now = fault_free(&self.state.covariance_entries());
        let then = fault_free(&base.covariance);
        let expected = self.prediction.growth.after(passed);
        let by_heading = base.level.heading.min(1.0) * travelled;
        ProtectionLevel {
            position: base.level.position
                + ((now.position - then.position).max(0.0) + by_heading).max(expected.position),
            heading: base.level.heading + (now.heading - then.heading).max(expected.heading),
        }
    }
}

/// Goes on by a motion. Of one that the localiser has used, or assumed, up to `known`, the rest counts.
fn predict(state: &mut Ekf, motion: &Motion, known: Time) {
    if motion.start < known {
        state.predict(&motion.split(known).1);
    } else {
        state.predict(motion);
    }
}

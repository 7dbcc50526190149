//! What the odometry says of the motion, and how the vehicle goes on where it says nothing.

use serde::{Deserialize, Serialize};

use super::{Capacities, Localizer, Misuse, Parameters, Reason};
use crate::filter::{KnownPose, Timeline};
use crate::integrity::WheelErrors;
use crate::maps::Verdict;
use crate::measurement::{EncoderFaults, Time};
use crate::odometry::{Coasting, Motion, OdometryError, UnknownAcceleration};

/// The odometry is not believed, or not heard.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(super) struct Outage {
    pub reason: Reason,
    pub coasting: Coasting,
    /// What was seen until this time raised the doubt; nothing that was seen, if it is the beginning of time.
    pub since: Time,
    /// The pose when landmarks corrected it last, if they have since the outage began.
    pub corrected: Option<(Time, KnownPose)>,
}

/// An odometry that says so often in a row what is not later than before has a clock that stands.
const MOST_REPEATED: u8 = 10;

/// A pose that was given for a time further ahead of the odometry than this, s, is of another clock.
const LONGEST_LEAD: f64 = 0.5;

/// A measurement that is further ahead of everything than this, s, tells nothing of where the vehicle has gone meanwhile.
const LONGEST_BRIDGE: f64 = 1.0;

/// The largest root of the sum of the squares of four differences of readings, each rounded to a tick, in ticks.
const ROUNDING: f64 = 2.0;

/// Landmarks that tell position and heading.
const TELLING: usize = 2;

/// Two corrections that are further apart, s, tell no velocity of now: of two revolutions one may be missed.
const LONGEST_APART: f64 = 0.3;

impl<C: Capacities> Localizer<C> {
    /// Lets the check of redundant wheels take a motion, and what of it does not fit.
    #[inline(never)]
    pub(super) fn compare_wheels(&mut self, found: &Result<(Motion, f64), OdometryError>) {
        let check = &mut self.integrity.redundancy;
        let Ok((motion, slip)) = found else { return check.clear() };
        let Parameters { assumed, odometry_noise, .. } = &self.parameters;
        let lasting = assumed.scale * assumed.scale + assumed.steering * assumed.steering;
        let step = ROUNDING * self.odometer.resolution();
        check.travel(motion, *slip, &WheelErrors { slip: odometry_noise.slip, lasting, step });
    }

    pub(super) fn move_by(&mut self, time: Time, motion: Result<Motion, OdometryError>) {
        if let Err(error) = &motion {
            self.outputs.misuse = match error {
                OdometryError::WrongVehicle => Some(Misuse::WrongVehicle),
                OdometryError::OutOfOrder => Some(Misuse::OutOfOrder),
                _ => None,
            };
        }
        let Some(start) = self.timeline.begun().map(Timeline::start) else {
            return;
        };
        match &motion {
            // A pose may be given for a time between two samples; only what follows it counts.
            Ok(motion) if motion.end > start => {
                self.outage = None;
                self.repeated = 0;
                // A motion is large: it is copied only where it changes.
                let within = (motion.start < start).then(|| motion.split(start).1);
                let motion = within.as_ref().unwrap_or(motion);
                if self.parameters.maps.slam {
                    let lever = self.parameters.vehicle.steering_lever();
                    self.go_on(&motion.corrected(&self.slam.bias(), lever));
                } else if self.gyro.is_some() {
                    self.go_on_by_gyro(motion);
                } else {
                    self.go_on(motion);
                }
            }
            Err(OdometryError::Implausible) => self.coast(time, Reason::OdometryImplausible),
            Err(OdometryError::Pause) => self.coast(time, Reason::OdometrySilent),
            // The first sample behind a fault: the next one says how the vehicle moves.
            Err(OdometryError::First) => {
                if let Some(outage) = self.outage {
                    self.coast(time, outage.reason);
                }
            }
            // What the odometry should say does not come.
            Err(OdometryError::WrongVehicle) => self.bridge(time, time),
            // Once it is a frame that was sent twice.
            Err(OdometryError::OutOfOrder) => {
                self.repeated = self.repeated.saturating_add(1);
                if self.repeated >= MOST_REPEATED {
                    self.doubt_odometry(Reason::OdometryImplausible, Time::default());
                }
                // One report was stamped so far ahead that the vehicle went on to where it is not yet.
                if self.repeated >= MOST_REPEATED && self.timeline.now().since(time) > LONGEST_LEAD {
                    (self.lost, self.repeated) = (Some(Reason::NoPose), 0);
                }
            }
            // Whoever gave that pose has a clock that is ahead: the vehicle has not been there yet.
            Ok(motion) if start.since(motion.end) > LONGEST_LEAD => self.lost = Some(Reason::NoPose),
            Ok(_) => {}
        }
    }

    /// Goes on to `time`, at which something was seen, if that is too far ahead of an odometry that is silent. What the
    /// odometry says later of the same time counts instead.
    #[inline(never)]
    pub(super) fn bridge(&mut self, from: Time, time: Time) {
        let limit = self.parameters.limits.longest_extrapolation;
        let Some(timeline) = self.timeline.begun().filter(|timeline| time.since(timeline.last_report()) > limit) else {
            return;
        };
        let now = timeline.now();
        let unknown = self.unknown_acceleration();
        let Some(Outage { reason, since, .. }) = self.outage else {
            self.doubt_odometry(Reason::OdometrySilent, time);
            return;
        };
        // A laser whose clock has jumped looks the same, until the odometry speaks before the next revolution.
        if from <= since {
            return;
        }
        let mut coasting = self.doubt_odometry(reason, since);
        // What was extrapolated has been assumed already.
        let _ = coasting.to(now, &unknown);
        if time.since(now) <= LONGEST_BRIDGE
            && let Some(motion) = coasting.to(time, &unknown)
        {
            let motion = self.gyro.as_ref().map_or(motion, |gyro| gyro.turn_assumed(&motion));
            self.keep_up();
            self.timeline.assume(&motion);
            if self.parameters.protection {
                self.separation.assume(&motion);
            }
        }
    }

    fn unknown_acceleration(&self) -> UnknownAcceleration {
        UnknownAcceleration::of(&self.parameters.vehicle, &self.parameters.odometry_noise)
    }

    /// Does not believe the odometry from its last motion on, and returns how the vehicle may go on.
    pub(super) fn doubt_odometry(&mut self, reason: Reason, since: Time) -> Coasting {
        let outage = self.outage.map_or_else(
            || Outage { reason, coasting: Coasting::new(self.timeline.recent_motion()), since, corrected: None },
            |outage| Outage { reason, since, ..outage },
        );
        self.outage = Some(outage);
        self.integrity.doubt_odometry();
        self.separation.lose_motion();
        outage.coasting
    }

    /// Lets landmarks that have corrected the pose without odometry tell how fast the vehicle goes.
    #[inline(never)]
    pub(super) fn correct_coasting(&mut self) {
        let unknown = self.unknown_acceleration();
        let telling = self.outputs.uses.iter().filter(|seen| seen.verdict == Verdict::Accepted).count();
        let Some(timeline) = self.timeline.begun_mut().filter(|_| telling >= TELLING && self.lost.is_none()) else {
            return;
        };
        let Some(outage) = &mut self.outage else { return };
        let (now, state) = (timeline.now(), timeline.state());
        let known = KnownPose { pose: state.pose, covariance: state.covariance() };
        let before = outage.corrected.replace((now, known));
        match before.filter(|(time, _)| now > *time && now.since(*time) <= LONGEST_APART) {
            Some((time, before)) => outage.coasting.correct_velocity(&before.motion_to(&known, time, now), &unknown),
            None => outage.coasting.correct(now),
        }
    }

    pub(super) fn go_on(&mut self, motion: &Motion) {
        self.distance.advance(motion.distance);
        self.keep_up();
        self.timeline.advance(motion);
        if self.parameters.protection {
            self.separation.travel(motion, self.timeline.odometry_pose());
        }
    }

    /// Before a motion is forgotten that the filter with landmarks has not seen, as the laser is silent.
    pub(super) fn keep_up(&mut self) {
        if self.parameters.maps.slam
            && self.lost.is_none()
            && let Some(time) = self.timeline.oldest_after_next()
            && time > self.slam.time()
        {
            self.slam.advance(time, &self.timeline, &self.parameters);
        }
    }

    #[inline(never)]
    pub(super) fn doubt_encoders(&mut self, faults: &EncoderFaults) {
        let reason = match (faults.drive, faults.steering) {
            (Some(_), _) => Reason::DriveEncoder,
            (None, Some(_)) => Reason::SteeringEncoder,
            // Samples follow, and end the outage.
            (None, None) => return,
        };
        // What the counters did meanwhile is not to be taken for a motion.
        self.odometer.restart();
        self.coast(faults.time, reason);
    }

    /// Goes on to `time` without the odometry.
    fn coast(&mut self, time: Time, reason: Reason) {
        if self.timeline.begun().is_none() {
            return;
        }
        let is_first = self.outage.is_none();
        let mut coasting = self.doubt_odometry(reason, Time::default());
        let unknown = self.unknown_acceleration();
        // What was extrapolated so far, no report makes up for.
        self.timeline.accept_assumed();
        let _ = coasting.to(self.timeline.now(), &unknown);
        if let Some(mut motion) = coasting.to(time, &unknown) {
            if is_first && reason == Reason::OdometryImplausible {
                // It may have been right, as far as the vehicle can go.
                let refused = self.odometer.refused();
                motion.covariance.m11 += refused * refused;
            }
            if !self.coast_by_gyro(&motion) {
                self.go_on(&motion);
            }
        }
        if let Some(outage) = &mut self.outage {
            outage.coasting = coasting;
        }
    }
}

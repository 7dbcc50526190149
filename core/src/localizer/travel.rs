//! What the odometry says of the motion, and how the vehicle goes on where it says nothing.

use super::{Capacities, Localizer, Misuse, Parameters, Reason};
use crate::filter::Timeline;
use crate::integrity::WheelErrors;
use crate::measurement::{EncoderFaults, Time};
use crate::odometry::{Coasting, Motion, OdometryError};

/// The odometry is not believed, or not heard.
#[derive(Clone, Copy, Debug)]
pub(super) struct Outage {
    pub reason: Reason,
    pub coasting: Coasting,
    /// What was seen until this time raised the doubt; nothing that was seen, if it is the beginning of time.
    pub since: Time,
}

/// An odometry that says so often in a row what is not later than before has a clock that stands.
const MOST_REPEATED: u8 = 10;

/// A pose that was given for a time further ahead of the odometry than this, s, is of another clock.
const LONGEST_LEAD: f64 = 0.5;

/// A measurement that is further ahead of everything than this, s, tells nothing of where the vehicle has gone meanwhile.
const LONGEST_BRIDGE: f64 = 1.0;

impl<C: Capacities> Localizer<C> {
    /// Lets the check of redundant wheels take a motion, and what of it does not fit.
    #[inline(never)]
    pub(super) fn compare_wheels(&mut self, found: &Result<(Motion, f64), OdometryError>) {
        let check = &mut self.integrity.redundancy;
        let Ok((motion, slip)) = found else { return check.clear() };
        let Parameters { assumed, odometry_noise, .. } = &self.parameters;
        let lasting = assumed.scale * assumed.scale + assumed.steering * assumed.steering;
        check.travel(motion, *slip, &WheelErrors { slip: odometry_noise.slip, lasting });
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
        let Some(timeline) = self.timeline.begun().filter(|timeline| time.since(timeline.last_motion().end) > limit)
        else {
            return;
        };
        let now = timeline.now();
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
        let _ = coasting.to(now, &self.parameters.odometry_noise);
        if time.since(now) <= LONGEST_BRIDGE
            && let Some(motion) = coasting.to(time, &self.parameters.odometry_noise)
        {
            self.keep_up();
            self.timeline.assume(&motion);
        }
    }

    /// Does not believe the odometry from its last motion on, and returns how the vehicle may go on.
    pub(super) fn doubt_odometry(&mut self, reason: Reason, since: Time) -> Coasting {
        let recent = || Coasting::new(self.timeline.recent_motion(Coasting::SPAN));
        let coasting = self.outage.map_or_else(recent, |outage| outage.coasting);
        self.outage = Some(Outage { reason, coasting, since });
        self.integrity.doubt_odometry();
        coasting
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
        let mut coasting = self.doubt_odometry(reason, Time::default());
        if let Some(motion) = coasting.to(time, &self.parameters.odometry_noise) {
            if let Some(gyro) = &mut self.gyro {
                gyro.forget_rest();
            }
            self.go_on(&motion);
        }
        self.outage = Some(Outage { reason, coasting, since: Time::default() });
    }
}

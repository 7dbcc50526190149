//! How a vehicle has moved that does not know where it is: what it has seen is carried along, as long as the odometry may be believed.

use serde::{Deserialize, Serialize};

use super::{Event, Parameters};
use crate::geometry::{Point, Pose};
use crate::measurement::{ReflectorObservation, Time};
use crate::odometry::{Motion, OdometryError, RecentMotion, VehicleOdometer};

/// Silence after which the odometry says nothing of the present, s.
const LONGEST_SILENCE: f64 = 0.3;

/// What an event says of the motion.
#[derive(Clone, Copy, Debug)]
pub(super) enum Moved {
    /// It says nothing.
    Nothing,
    /// The vehicle has moved on.
    By(Motion),
    /// What was seen before cannot be carried on.
    Anew,
}

/// What a scan, or reflectors, seen at a time are worth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Sight {
    /// They are placed by the motion.
    Usable,
    /// Nobody says how the vehicle moves: it is taken to stand, and what was seen before is forgotten.
    Anew,
    /// Nothing.
    Useless,
}

/// The motion since the vehicle began to look around.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct StartOdometry {
    odometer: VehicleOdometer,
    recent: RecentMotion,
    /// Nothing that was seen before is placed, as nobody knows how the vehicle moved.
    known_from: Option<Time>,
    /// Whether an encoder fails: then nobody knows how the vehicle moves.
    is_blind: bool,
    /// Where the odometry has R.
    pose: Pose,
    /// Whether the odometry has said something since something was seen.
    has_spoken: bool,
}

impl StartOdometry {
    pub(super) fn new(parameters: &Parameters) -> Self {
        Self {
            odometer: VehicleOdometer::new(&parameters.vehicle, &parameters.odometer()),
            recent: RecentMotion::standing(Time::default()),
            known_from: None,
            is_blind: false,
            pose: Pose::default(),
            has_spoken: false,
        }
    }

    /// Where the odometry has R.
    pub(super) fn pose(&self) -> &Pose {
        &self.pose
    }

    /// How it has moved of late.
    pub(super) fn recent(&self) -> &RecentMotion {
        &self.recent
    }

    /// What was seen earlier is not placed; none if nothing is.
    pub(super) fn known_from(&self) -> Option<Time> {
        self.known_from
    }

    /// Where a reflector is in R as the vehicle is now, by how it has moved of late, or goes on: it was seen by a laser at `mount` in R.
    pub(super) fn place(&self, seen: &ReflectorObservation, mount: &Pose) -> Point {
        let range = f64::from(seen.range);
        let (sine, cosine) = libm::sincos(f64::from(seen.bearing));
        let in_robot = mount.transform(&Point::new(range * cosine, range * sine));
        self.recent.pose_at(seen.time).transform(&in_robot)
    }

    /// Takes an event.
    pub(super) fn take(&mut self, event: &Event) -> Moved {
        match event {
            Event::Encoders(sample) => {
                let motion = self.odometer.encoders(sample);
                self.travel(sample.time, motion)
            }
            Event::Speed(sample) => {
                let motion = self.odometer.speed(sample);
                self.travel(sample.time, motion)
            }
            Event::Increment(increment) => {
                let motion = self.odometer.increment(increment);
                self.travel(increment.time, motion)
            }
            Event::Wheels(sample) => {
                let motion = self.odometer.wheels(sample);
                self.travel(sample.time, motion)
            }
            Event::EncoderFaults(faults) => {
                self.forget();
                self.is_blind = faults.drive.is_some() || faults.steering.is_some();
                Moved::Anew
            }
            Event::SetPose(_) => {
                self.forget();
                Moved::Anew
            }
            Event::Gyro(_) | Event::Reflectors(_) | Event::Scan(_) => Moved::Nothing,
        }
    }

    /// Forgets how the vehicle has moved.
    pub(super) fn forget(&mut self) {
        self.odometer.restart();
        self.has_spoken = false;
        self.stand(Time::default());
        self.known_from = None;
    }

    /// Begins with a vehicle that stands at `time`, as nobody says otherwise.
    fn stand(&mut self, time: Time) {
        self.pose = Pose::default();
        self.recent = RecentMotion::standing(time);
        self.known_from = Some(time);
    }

    fn travel(&mut self, time: Time, motion: Result<Motion, OdometryError>) -> Moved {
        self.has_spoken = true;
        self.is_blind = false;
        match motion {
            Ok(motion) => {
                self.pose = self.pose.compose(&motion.displacement);
                self.recent.add(&motion);
                self.known_from.get_or_insert(motion.start);
                Moved::By(motion)
            }
            Err(OdometryError::First | OdometryError::Implausible | OdometryError::Pause) => {
                self.stand(time);
                Moved::Anew
            }
            Err(OdometryError::OutOfOrder | OdometryError::WrongVehicle) => Moved::Nothing,
        }
    }

    /// Something is seen, at a time if it tells one.
    pub(super) fn see(&mut self, time: Option<Time>) -> Sight {
        if self.is_blind {
            return Sight::Useless;
        }
        let has_spoken = core::mem::take(&mut self.has_spoken);
        let Some(time) = time.filter(|time| time.since(self.recent.end()) > LONGEST_SILENCE) else {
            return Sight::Usable;
        };
        // An odometry that speaks tells the time; the clock of the laser does not.
        if has_spoken {
            return Sight::Useless;
        }
        self.odometer.restart();
        self.stand(time);
        Sight::Anew
    }
}

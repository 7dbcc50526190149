//! Whether the laser moves as the odometry says while the vehicle does not know where it is.
//!
//! A laser that is knocked then gives afterwards what a vehicle in order gives that stands elsewhere. Only at that moment do reflectors and
//! surfaces around it show it.

use serde::{Deserialize, Serialize};

use super::start_odometry::{Moved, Sight, StartOdometry};
use super::{Event, Parameters};
use crate::geometry::Pose;
use crate::integrity::Integrity;
use crate::measurement::{Reflectors, Scan};

/// The motion before the first pose, and what has contradicted it.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct StartWatch {
    odometry: StartOdometry,
    is_contradicted: bool,
}

impl StartWatch {
    pub(super) fn new(parameters: &Parameters) -> Self {
        Self { odometry: StartOdometry::new(parameters), is_contradicted: false }
    }

    /// Takes an event before the first pose, and lets the checks of the motion compare it.
    pub(super) fn take(&mut self, event: &Event, parameters: &Parameters, integrity: &mut Integrity) {
        if matches!(self.odometry.take(event), Moved::Anew) {
            integrity.forget_motion();
        }
        let is_contradicted = match event {
            Event::Reflectors(seen) => self.see_reflectors(seen, parameters, integrity),
            Event::Scan(scan) => self.see_scan(scan, parameters, integrity),
            _ => false,
        };
        self.is_contradicted |= is_contradicted;
    }

    /// Ends the watch. True if the laser has moved otherwise than the odometry has said.
    pub(super) fn end(&mut self) -> bool {
        core::mem::take(&mut self.is_contradicted)
    }

    fn see_reflectors(&mut self, seen: &Reflectors, parameters: &Parameters, integrity: &mut Integrity) -> bool {
        let Some(mount) = parameters.lasers.mount(seen.laser).filter(|_| parameters.uses_reflectors()) else {
            return false;
        };
        match self.odometry.see(seen.observations.first().map(|first| first.time)) {
            Sight::Usable => {}
            Sight::Anew => integrity.forget_motion(),
            Sight::Useless => return false,
        }
        let odometry = &self.odometry;
        let places = seen.observations.iter().map(|observation| {
            (odometry.pose().transform(&odometry.place(observation, mount)), f64::from(observation.range))
        });
        integrity.see_places(seen.laser, odometry.recent().end(), places)
    }

    fn see_scan(&self, scan: &Scan, parameters: &Parameters, integrity: &mut Integrity) -> bool {
        let Some(mount) = parameters.lasers.mount(scan.laser).filter(|_| parameters.uses_reflectors()) else {
            return false;
        };
        let sensor = |seconds: f64| -> Pose {
            let in_robot = self.odometry.recent().pose_at(scan.start.offset(seconds));
            self.odometry.pose().compose(&in_robot).compose(mount)
        };
        integrity.see_scan(scan, sensor)
    }
}

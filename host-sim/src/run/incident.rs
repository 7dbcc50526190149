//! What is worth a log of its own.

use std::fmt;

use agv_core::integrity::{Alarm, AlertLimits};
use agv_core::measurement::Time;
use agv_core::state::{Mode, PoseOutput};

/// What has happened.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Incident {
    /// The vehicle does not know any more where it is.
    Lost,
    /// The controller has told the bus of a fault.
    Fault,
    /// The protection level is above its alert limit for travelling.
    Alarm,
}

impl fmt::Display for Incident {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Lost => "lost",
            Self::Fault => "fault",
            Self::Alarm => "alarm",
        })
    }
}

/// What lasts, or comes again within so many seconds, is one incident.
const CALM: f64 = 10.0;

/// Finds incidents in what is published.
pub(super) struct IncidentWatch {
    limits: AlertLimits,
    was_localised: bool,
    /// When the vehicle was lost last, and when an alarm was.
    last: [Option<Time>; 2],
}

impl IncidentWatch {
    /// A watch over a vehicle that can live with these levels.
    pub const fn new(limits: AlertLimits) -> Self {
        Self { limits, was_localised: false, last: [None; 2] }
    }

    /// Takes a pose that was published. A vehicle that has not known yet where it is has no incident.
    pub fn see(&mut self, pose: &PoseOutput) -> Option<Incident> {
        self.was_localised |= pose.mode.is_localised();
        let is_lost = pose.mode == Mode::Lost;
        let is_alarmed = !is_lost && self.limits.alarm(pose.mode, &pose.level) >= Alarm::Travel;
        let [lost, alarm] = &mut self.last;
        let found = [(is_lost, lost, Incident::Lost), (is_alarmed, alarm, Incident::Alarm)];
        let mut new = None;
        for (_, last, incident) in found.into_iter().filter(|(is_so, ..)| *is_so && self.was_localised) {
            if last.is_none_or(|last| pose.time.since(last) > CALM) {
                new = Some(incident);
            }
            *last = Some(pose.time);
        }
        new
    }
}

#[cfg(test)]
mod tests {
    use agv_core::geometry::Pose;
    use agv_core::localizer::{Localizer, Parameters};
    use agv_core::odometry::Vehicle;

    use super::*;

    #[test]
    fn what_lasts_is_one_incident() {
        let parameters = Parameters::new(Vehicle::Increments, Pose::default());
        let localizer: Box<Localizer> = Box::new(Localizer::new(parameters));
        let mut pose = localizer.outputs().pose;
        let mut watch = IncidentWatch::new(parameters.alert_limits);
        let mut see = |seconds: f64, mode: Mode, level: f64| {
            (pose.time, pose.mode) = (Time::from_seconds(seconds), mode);
            (pose.level.position, pose.level.heading) = (level, 0.0);
            watch.see(&pose)
        };
        // Before it has known where it is.
        assert_eq!(see(1.0, Mode::NotLocalised, f64::INFINITY), None);
        assert_eq!(see(2.0, Mode::Lost, f64::INFINITY), None);
        assert_eq!(see(3.0, Mode::Reflectors, 0.01), None);
        assert_eq!(see(4.0, Mode::Reflectors, 1.0), Some(Incident::Alarm));
        for second in 5..30 {
            assert_eq!(see(f64::from(second), Mode::Reflectors, 1.0), None, "{second}");
        }
        assert_eq!(see(30.0, Mode::Lost, 1.0), Some(Incident::Lost));
        assert_eq!(see(35.0, Mode::Reflectors, 0.01), None);
        assert_eq!(see(39.0, Mode::Lost, 1.0), None);
        assert_eq!(see(50.0, Mode::Reflectors, 0.01), None);
        assert_eq!(see(51.0, Mode::Lost, 1.0), Some(Incident::Lost));
    }
}

//! What an event's landmarks say, for the solutions that bound the error of the pose.

use nalgebra::Matrix2;

use super::contours::ContourCorrection;
use super::{Capacities, Localizer};
use crate::filter::{Cartesian, Observation, RangeBearing};
use crate::geometry::{Point, Pose};
use crate::integrity::Suspect;
use crate::integrity::separation::{LandmarkKey, Laser, Seen, SensorInformation};
use crate::maps::{Landmark, LandmarkKind, Verdict};
use crate::measurement::{LaserId, Time};
use crate::sources::{LandmarkMaps, Sighting};
use crate::state::{LandmarkSource, LandmarkUse};

impl<C: Capacities> Localizer<C> {
    /// Tells the solutions what the event has seen, at the time of the newest motion. Of two lasers the first one is judged; what
    /// the other has corrected is part of the separation.
    #[inline(never)]
    pub(super) fn separate(&mut self, laser: Option<LaserId>) {
        if self.timeline.begun().is_none() || !self.parameters.protection {
            return;
        }
        let now = self.timeline.now();
        let pose = self.timeline.state().pose;
        self.separation.step(now, self.timeline.odometry_pose());
        let mount = *self.parameters.lasers.first();
        let from = self.separation.laser(&mount, &pose);
        self.separation.begin_event();
        let first = self.outputs.uses.iter().map(|seen| seen.time).min();
        if let Some(first) = first.filter(|_| laser == Some(LaserId::FIRST) && self.lost.is_none()) {
            self.workspace.path.set(first, &mount, self.timeline.relative_path(first, now));
            for index in 0..self.outputs.uses.len() {
                let Some(seen) = self.outputs.uses.get(index).copied() else { break };
                self.tell(&seen, first, &from);
            }
        }
        self.tell_contours_pose(&mount, &from);
        if laser == Some(LaserId::FIRST) {
            self.separation.hear_laser(self.laser_odometry.pose(self.timeline.odometry_pose(), &mount));
        }
        self.separation.doubt_motion(self.integrity.is_motion_doubtful());
        self.separation.doubt_laser(self.integrity.suspect() == Some(Suspect::Laser));
        let square = self.integrity.innovations.mean_normalised_square();
        self.separation.end_event(&pose, &from, libm::sqrt((0.5 * square).max(1.0)));
        self.growth = self.separation.growth(&self.timeline.recent_motion());
    }

    /// Tells where contours have the laser, moved to now by the odometry.
    fn tell_contours_pose(&mut self, mount: &Pose, from: &Laser) {
        let ContourCorrection::Told { time, seen } = &self.contour_correction else { return };
        if self.lost.is_some() {
            return;
        }
        let since = self.timeline.displacement(*time, self.timeline.now()).compose(mount);
        let jacobian = seen.pose.compose_jacobian_first(&since);
        let covariance = jacobian * seen.covariance_matrix() * jacobian.transpose();
        let told = SensorInformation::of_pose(&seen.pose.compose(&since), &covariance, &seen.shared, &from.sensor);
        self.separation.take(LandmarkKey::Contours, told);
    }

    fn tell(&mut self, seen: &LandmarkUse, first: Time, from: &Laser) {
        let [x, y] = seen.position.map(f64::from);
        let range = libm::hypot(x, y);
        let is_reflector = seen.kind == LandmarkKind::Reflector;
        let radius = self.parameters.association.reflector_radius;
        let landmark = match seen.landmark {
            Some((LandmarkSource::Fixed, id)) => self.fixed_landmark(seen, id),
            Some((LandmarkSource::Dynamic, _)) => return,
            None => None,
        };
        match (landmark, seen.verdict) {
            (Some(landmark), Verdict::Accepted) => {
                let key = if is_reflector { LandmarkKey::Reflector(landmark.id) } else { LandmarkKey::Features };
                let path = &self.workspace.path;
                let at_first = path.to_start(seen.time.since(first), &Point::new(x, y));
                let position = path.from_start(self.timeline.now().since(first), &at_first);
                let deviation = f64::from(landmark.deviation);
                let told = Seen {
                    position,
                    covariance: self.covariance_of(seen, &position),
                    landmark: landmark.position(),
                    landmark_variance: deviation * deviation,
                };
                self.separation.see(key, &told, from);
            }
            (Some(landmark), Verdict::Gated) if is_reflector => {
                let [x, y] = seen.located;
                let place = landmark.position();
                self.separation.displace([place.x - x, place.y - y], range);
            }
            (None, Verdict::Unknown) if is_reflector && self.has_reflectors() => {
                self.separation.contradict(radius, range);
            }
            _ => {}
        }
    }

    pub(super) fn has_reflectors(&self) -> bool {
        !self.maps.reflectors().landmarks().is_empty()
    }

    /// The landmark of a fixed map that something was compared with.
    fn fixed_landmark(&self, seen: &LandmarkUse, id: u16) -> Option<Landmark> {
        let at = Point::from(seen.located);
        let association = &self.parameters.association;
        let is_it = |landmark: &&Landmark| landmark.id == id && landmark.kind == seen.kind;
        if seen.kind == LandmarkKind::Reflector {
            self.maps.reflectors().near(at, association.reflector_radius).find(is_it).copied()
        } else {
            self.maps.features().near(at, association.feature_radius).find(is_it).copied()
        }
    }

    /// How exactly something is seen at a position in S, m^2: features as their detector states it, and as the filter has used them.
    fn covariance_of(&self, seen: &LandmarkUse, position: &Point) -> Matrix2<f64> {
        if seen.kind != LandmarkKind::Reflector {
            let is_it = |sighting: &&Sighting| sighting.time == seen.time && sighting.kind == seen.kind;
            let sighting = self.workspace.sightings.iter().find(is_it);
            if let Some(Observation::Cartesian(Cartesian { covariance, .. })) = sighting.map(|one| one.observation) {
                return covariance;
            }
        }
        let reflectors = &self.parameters.reflectors;
        RangeBearing {
            range: libm::hypot(position.x, position.y),
            bearing: libm::atan2(position.y, position.x),
            range_variance: reflectors.range_deviation * reflectors.range_deviation,
            bearing_variance: reflectors.bearing_deviation * reflectors.bearing_deviation,
        }
        .cartesian()
        .covariance
    }
}

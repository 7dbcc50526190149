//! Simultaneous localisation and mapping: pose, calibration, landmarks and a few past poses in one filter.
//!
//! The filter stands a little in the past, at the middle of the last scan that it has used; the timeline carries its pose on
//! by the odometry. Landmarks that are given beforehand enter the state when they are seen, with the variance that the map
//! states, so that seeing one often does not make its place certain.

use serde::{Deserialize, Serialize};

use super::Parameters;
use crate::filter::{BiasModel, Ekf, Slots, Timeline};
use crate::geometry::{Point, Pose, difference};
use crate::maps::LandmarkKind;
use crate::measurement::Time;
use crate::odometry::OdometryBias;
use crate::sensing::PointView;
use crate::sources::{Believed, Comparison, KeyScans, LandmarkSlots, Sighting, SlamParameters, SourceStatus};

/// The map in the state.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(bound = "")]
pub(super) struct Slam<S: Slots> {
    filter: Ekf<S>,
    slots: LandmarkSlots<S>,
    key_scans: KeyScans<S>,
    /// Time at which the filter stands.
    time: Time,
    /// Where the vehicle was when it came to the present place, and how many scans have been used there.
    place: (Pose, u16),
}

impl<S: Slots> Slam<S> {
    #[inline(always)]
    pub(super) fn new() -> Self {
        Self {
            filter: Ekf::empty(),
            slots: LandmarkSlots::new(),
            key_scans: KeyScans::new(),
            time: Time::default(),
            place: (Pose::default(), 0),
        }
    }

    /// Begins at a pose that is true at `time`. The biases begin anew with their priors: who gives a pose may have loaded the
    /// vehicle or mounted its laser anew, and to learn them again takes some metres only.
    pub(super) fn begin(&mut self, time: Time, state: &Ekf, parameters: &SlamParameters) {
        self.filter.begin_biases(&parameters.biases);
        self.filter.begin(state);
        self.slots.clear();
        self.key_scans.clear();
        self.time = time;
        self.place = (state.pose, 0);
    }

    /// Forgets the landmarks that were given beforehand, as their map is replaced.
    pub(super) fn forget_given(&mut self) {
        let Self { slots, filter, .. } = self;
        slots.forget_given(|slot| filter.remove_landmark(slot));
    }

    /// Forgets past poses, as scans are compared with other surfaces from now on.
    pub(super) fn forget_way_behind(&mut self) {
        self.filter.forget_poses();
        self.key_scans.clear();
    }

    /// What is known of the odometry's bias.
    pub(super) fn bias(&self) -> OdometryBias {
        self.filter.bias()
    }

    /// The pose at the filter's time.
    pub(super) fn state(&self) -> Ekf {
        self.filter.state()
    }

    /// The filter's time.
    pub(super) fn time(&self) -> Time {
        self.time
    }

    /// Goes on to `time`, by the motions of the timeline.
    pub(super) fn advance<const PAST: usize>(
        &mut self,
        time: Time,
        timeline: &Timeline<PAST>,
        parameters: &Parameters,
    ) {
        let model = BiasModel { lever: parameters.vehicle.steering_lever(), walk: parameters.slam.bias_walk };
        // Motions of about a millisecond would cost as much as those of ten.
        for motion in timeline.motions(self.time, time) {
            if motion.end > self.time {
                self.filter.predict_with(&motion, &model);
            }
        }
        self.time = time.max(self.time);
    }

    /// The landmarks in the state.
    pub(super) fn landmarks(&self) -> impl Iterator<Item = (LandmarkKind, Point)> + '_ {
        self.slots.occupied().filter_map(|(slot, landmark)| Some((landmark.kind, self.filter.landmark(slot)?)))
    }

    /// Whether a scan at the present pose tells something new: the vehicle has moved, or few scans have been used here.
    pub(super) fn wants_scan(&mut self, parameters: &SlamParameters) -> bool {
        let pose = self.filter.state().pose;
        let (here, used) = self.place;
        let is_here = libm::hypot(pose.x - here.x, pose.y - here.y) <= parameters.place_size
            && libm::fabs(difference(pose.theta, here.theta)) <= parameters.place_turn;
        if is_here && used >= parameters.scans_a_place {
            return false;
        }
        self.place = if is_here { (here, used + 1) } else { (pose, 1) };
        true
    }

    /// The filter and what is known of its landmarks.
    pub(super) fn parts(&mut self) -> (&mut Ekf<S>, &mut LandmarkSlots<S>) {
        (&mut self.filter, &mut self.slots)
    }

    /// Takes something seen from the filter's state for a new landmark, unless one of its kind is so near that it may be that.
    pub(super) fn discover(&mut self, seen: &Sighting, believed: Believed) {
        let comparison = Comparison::new(&self.filter, seen, believed);
        let (located, from, orientation) = (comparison.located, comparison.from, comparison.orientation());
        let least = match seen.kind {
            LandmarkKind::Reflector => 0.5 * believed.association.reflector_radius,
            _ => believed.slam.least_distance,
        };
        let is_near = |slot: usize| {
            self.filter
                .landmark(slot)
                .is_some_and(|position| libm::hypot(position.x - located.x, position.y - located.y) < least)
        };
        let is_known = self
            .slots
            .occupied()
            .any(|(slot, landmark)| landmark.resembles(seen.kind, orientation, believed.slam) && is_near(slot));
        if is_known {
            return;
        }
        if let Some(slot) = self.slots.free() {
            self.filter.add_landmark(slot, &from, &seen.observation.cartesian());
            self.slots.enter(slot, None, seen.kind, orientation);
        }
    }

    /// Ends a scan of features, or one of reflectors: landmarks that nobody believes in go.
    pub(super) fn finish(&mut self, are_reflectors: bool, parameters: &SlamParameters) {
        let filter = &mut self.filter;
        self.slots.finish(are_reflectors, parameters, |slot| filter.remove_landmark(slot));
    }

    /// Aligns a scan of the first laser to the key scans; S is at `place` in the frame of its points.
    pub(super) fn align(
        &mut self,
        points: PointView<'_>,
        place: &Pose,
        parameters: &Parameters,
        status: &mut SourceStatus,
    ) {
        let (mount, told) = (*parameters.lasers.first(), (self.time, status));
        self.key_scans.align(&mut self.filter, points, place, &mount, &parameters.slam.key_scans, told);
    }

    /// Makes a scan a key scan if it is time for one; to be called when all that it tells has been used.
    pub(super) fn keep(&mut self, points: PointView<'_>, place: &Pose, parameters: &Parameters) {
        self.key_scans.keep(&mut self.filter, points, place, &parameters.slam.key_scans);
    }
}

//! Simultaneous localisation and mapping: pose, calibration, landmarks and a few past poses in one filter.
//!
//! The filter stands a little in the past, at the middle of the last scan that it has used; the timeline carries its pose on
//! by the odometry. Landmarks that are given beforehand enter the state when they are seen, with the variance that the map
//! states, so that seeing one often does not make its place certain.

mod key_scans;
mod landmark_book;
mod parameters;

pub use parameters::{KeyScanParameters, SlamParameters};

use crate::filter::{
    Augmented, Cartesian, Ekf, Innovation, Observation, SparseLinearisation, Timeline, augmented_states, packed_entries,
};
use crate::geometry::{Point, Pose, difference};
use crate::localizer::{LandmarkSource, Parameters};
use crate::maps::{LandmarkKind, NearestNeighbour, Verdict};
use crate::measurement::Time;
use crate::odometry::OdometryBias;
use crate::sensing::PointScan;

use super::evidence::Fate;
use super::maps::Maps;
use key_scans::KeyScans;
use landmark_book::LandmarkBook;

/// States of a filter with the usual room: 4 key scans and 64 landmarks.
pub const SLAM_STATES: usize = augmented_states(4, 64);
/// Entries of its covariance.
pub const SLAM_ENTRIES: usize = packed_entries(SLAM_STATES);

/// The map in the state.
#[derive(Clone, Debug)]
pub(super) struct Slam<const KEYS: usize, const LANDMARKS: usize, const STATES: usize, const ENTRIES: usize> {
    filter: Augmented<KEYS, LANDMARKS, STATES, ENTRIES>,
    book: LandmarkBook<LANDMARKS>,
    key_scans: KeyScans<KEYS>,
    /// Time at which the filter stands.
    time: Time,
    /// Where the vehicle was when it came to the present place, and how many scans have been used there.
    place: (Pose, u16),
}

/// A feature or a reflector as it is seen from S at the filter's time.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seen {
    pub kind: LandmarkKind,
    pub cartesian: Cartesian,
    /// Direction in S, rad.
    pub orientation: f32,
}

/// A landmark that something seen may be.
#[derive(Clone, Copy, Debug)]
enum Candidate {
    InState { place: usize, source: LandmarkSource, id: u16 },
    Given { id: u16, position: Point, variance: f64 },
}

impl<const KEYS: usize, const LANDMARKS: usize, const STATES: usize, const ENTRIES: usize>
    Slam<KEYS, LANDMARKS, STATES, ENTRIES>
{
    #[inline(always)]
    pub(super) fn new() -> Self {
        Self {
            filter: Augmented::new(),
            book: LandmarkBook::new(),
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
        self.book.clear();
        self.key_scans.clear();
        self.time = time;
        self.place = (state.pose, 0);
    }

    /// Forgets the landmarks that were given beforehand, as their map is replaced.
    pub(super) fn forget_given(&mut self) {
        let Self { book, filter, .. } = self;
        book.forget_given(|place| filter.remove_landmark(place));
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
        let lever = parameters.vehicle.steering_lever();
        // Motions of about a millisecond would cost as much as those of ten.
        for motion in timeline.motions(self.time, time) {
            if motion.end > self.time {
                self.filter.predict(&motion, lever, &parameters.slam.bias_walk);
            }
        }
        self.time = time.max(self.time);
    }

    /// The landmarks in the state.
    pub(super) fn landmarks(&self) -> impl Iterator<Item = (LandmarkKind, Point)> + '_ {
        self.book.entries().filter_map(|(place, entry)| Some((entry.kind, self.filter.landmark(place)?)))
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

    /// Takes a feature or a reflector.
    pub(super) fn see<const REFLECTORS: usize, const FEATURES: usize, const DYNAMIC: usize>(
        &mut self,
        seen: &Seen,
        maps: &Maps<REFLECTORS, FEATURES, DYNAMIC>,
        parameters: &Parameters,
    ) -> Fate {
        let located = self.filter.locate(&seen.cartesian.position, &parameters.laser);
        let orientation = self.orientation(seen, parameters);
        let (candidate, verdict, innovation) = self.associate(seen, &located, orientation, maps, parameters);
        let fate = |landmark| Fate { verdict, landmark, located };
        let Some((candidate, innovation)) = candidate.zip(innovation) else { return fate(None) };
        let (source, id) = match candidate {
            Candidate::InState { source, id, .. } => (source, id),
            Candidate::Given { id, .. } => (LandmarkSource::Fixed, id),
        };
        if verdict == Verdict::Accepted {
            let place = match candidate {
                Candidate::InState { place, .. } => Some(place),
                Candidate::Given { id, position, variance } => {
                    let place = self.book.place();
                    if let Some(place) = place {
                        self.filter.add_known_landmark(place, position, variance);
                        self.book.enter(place, Some(id), seen.kind, orientation);
                    }
                    place
                }
            };
            let observation = match (place, candidate) {
                (Some(place), _) => self.filter.observe_landmark(place, &seen.cartesian, &parameters.laser),
                (None, Candidate::Given { position, variance, .. }) => {
                    Some(self.filter.observe_known(&position, variance, &seen.cartesian, &parameters.laser))
                }
                (None, Candidate::InState { .. }) => None,
            };
            if observation.is_some_and(|observation| self.filter.correct(&observation))
                && let Some(place) = place
            {
                self.book.see(place);
            }
        }
        fate(Some((source, id, innovation)))
    }

    /// Takes a feature for a new landmark, unless one of its kind is so near that it may be that.
    pub(super) fn discover(&mut self, seen: &Seen, parameters: &Parameters) {
        let located = self.filter.locate(&seen.cartesian.position, &parameters.laser);
        let orientation = self.orientation(seen, parameters);
        let least = match seen.kind {
            LandmarkKind::Reflector => 0.5 * parameters.association.reflector_radius,
            _ => parameters.slam.least_distance,
        };
        let is_near = |place: usize| {
            self.filter
                .landmark(place)
                .is_some_and(|position| libm::hypot(position.x - located.x, position.y - located.y) < least)
        };
        let is_known = self
            .book
            .entries()
            .any(|(place, entry)| entry.resembles(seen.kind, orientation, &parameters.slam) && is_near(place));
        if is_known {
            return;
        }
        if let Some(place) = self.book.place() {
            self.filter.add_landmark(place, &seen.cartesian, &parameters.laser);
            self.book.enter(place, None, seen.kind, orientation);
        }
    }

    /// Ends a scan of features, or one of reflectors: landmarks that nobody believes in go.
    pub(super) fn finish(&mut self, are_reflectors: bool, parameters: &SlamParameters) {
        let filter = &mut self.filter;
        self.book.finish(are_reflectors, parameters, |place| filter.remove_landmark(place));
    }

    /// Aligns a scan to the key scans; S is at `place` in the frame of its points. May make it a key scan.
    pub(super) fn align<const BEAMS: usize>(
        &mut self,
        points: &PointScan<BEAMS>,
        place: &Pose,
        parameters: &Parameters,
    ) {
        if let Some(wanted) = &parameters.slam.key_scans {
            self.key_scans.align(&mut self.filter, points, place, &parameters.laser, wanted);
        }
    }

    /// Makes a scan a key scan if it is time for one; to be called when all that it tells has been used.
    pub(super) fn keep<const BEAMS: usize>(
        &mut self,
        points: &PointScan<BEAMS>,
        place: &Pose,
        parameters: &Parameters,
    ) {
        if let Some(wanted) = &parameters.slam.key_scans {
            self.key_scans.keep(&mut self.filter, points, place, wanted);
        }
    }

    fn orientation(&self, seen: &Seen, parameters: &Parameters) -> f32 {
        let sensor = self.filter.state().pose.theta + parameters.laser.theta + self.filter.laser_yaw();
        difference(f64::from(seen.orientation) + sensor, 0.0) as f32
    }

    fn associate<const REFLECTORS: usize, const FEATURES: usize, const DYNAMIC: usize>(
        &self,
        seen: &Seen,
        located: &Point,
        orientation: f32,
        maps: &Maps<REFLECTORS, FEATURES, DYNAMIC>,
        parameters: &Parameters,
    ) -> (Option<Candidate>, Verdict, Option<Innovation>) {
        let association = &parameters.association;
        let is_reflector = seen.kind == LandmarkKind::Reflector;
        let radius = if is_reflector { association.reflector_radius } else { association.feature_radius };
        let mut nearest = NearestNeighbour::default();
        let mut consider = |candidate: Candidate, linearisation: &SparseLinearisation<2>| {
            if let Some(innovation) = self.innovation(linearisation) {
                nearest.consider((candidate, innovation), innovation.normalised_square);
            }
        };
        for (place, entry) in self.book.entries() {
            let is_near = self.filter.landmark(place).is_some_and(|position| {
                libm::fabs(position.x - located.x) <= radius && libm::fabs(position.y - located.y) <= radius
            });
            if is_near
                && entry.resembles(seen.kind, orientation, &parameters.slam)
                && let Some(linearisation) = self.filter.observe_landmark(place, &seen.cartesian, &parameters.laser)
            {
                consider(Candidate::InState { place, source: entry.source, id: entry.id }, &linearisation);
            }
        }
        let mut given = |landmark: &crate::maps::Landmark| {
            if landmark.kind != seen.kind || self.book.has_fixed(landmark.id, landmark.kind) {
                return;
            }
            let (position, deviation) = (Point::new(landmark.x, landmark.y), f64::from(landmark.deviation));
            let variance = deviation * deviation;
            let linearisation = self.filter.observe_known(&position, variance, &seen.cartesian, &parameters.laser);
            consider(Candidate::Given { id: landmark.id, position, variance }, &linearisation);
        };
        if is_reflector && parameters.maps.reflectors {
            maps.reflectors.near(*located, radius).for_each(&mut given);
        } else if !is_reflector && parameters.maps.features {
            maps.features.near(*located, radius).for_each(&mut given);
        }
        let (best, verdict) = nearest.decide(association.gate, association.margin);
        (best.map(|best| best.landmark.0), verdict, best.map(|best| best.landmark.1))
    }

    fn innovation(&self, observation: &SparseLinearisation<2>) -> Option<Innovation> {
        Innovation::new(observation.residual, self.filter.residual_covariance(observation))
    }
}

/// An observation of a reflector or a feature in Cartesian form.
pub(super) fn cartesian(observation: &Observation) -> Cartesian {
    match observation {
        Observation::Cartesian(cartesian) => *cartesian,
        Observation::RangeBearing(seen) => seen.cartesian(),
    }
}

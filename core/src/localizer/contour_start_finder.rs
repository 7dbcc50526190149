//! Where a vehicle is that has been switched on, by the contours of a kept map.
//!
//! It stands beside the [`super::Localizer`] as the [`super::StartFinder`] does, and gives its answer in the same way.

use nalgebra::Matrix3;

use super::start_odometry::{Moved, Sight, StartOdometry};
use super::{Event, Parameters, PoseFix, StartState};
use crate::contours::{PlaceAnswer, PlaceFix, PlaceProgress};
use crate::geometry::Pose;
use crate::measurement::{LaserId, Scan};
use crate::sources::FindPlaces;

/// Looks in a row that must find the same place.
const LOOKS: u8 = 2;

/// They do within this distance, m, and turn, rad, by the odometry between them.
const SAME: (f64, f64) = (0.1, 0.02);

/// A found pose is not surer than this, m and rad.
const LEAST_DEVIATION: (f64, f64) = (0.02, 0.003);

/// By what the covariance is multiplied that takes points as independent.
const INFLATION: f64 = 3.0;

/// A place that was found.
#[derive(Clone, Copy, Debug)]
struct Look {
    /// Pose of R in W.
    pose: Pose,
    /// Where the odometry had R then.
    odometry: Pose,
}

/// Finds the pose of a vehicle that does not know it in a map of contours.
#[derive(Clone, Debug)]
pub struct ContourStartFinder<P: FindPlaces> {
    parameters: Parameters,
    odometry: StartOdometry,
    places: P,
    /// Where the odometry had R when the search began, and the pose of the scan's points in R then; none if no search is under way.
    begun: Option<(Pose, Pose)>,
    /// The last look, and how many in a row have found it.
    last: Option<(Look, u8)>,
}

impl<P: FindPlaces> ContourStartFinder<P> {
    /// A finder that has seen nothing.
    #[must_use]
    #[inline(always)]
    pub fn new(parameters: Parameters) -> Self {
        Self { odometry: StartOdometry::new(&parameters), places: P::new(), begun: None, last: None, parameters }
    }

    /// The map has been replaced; what was found in the old one is forgotten.
    pub fn forget_map(&mut self) {
        self.places.forget_map();
        self.begin_anew();
    }

    /// Takes one event. A scan of the first laser begins a search unless one is under way.
    pub fn handle(&mut self, event: &Event) {
        if let Moved::Anew = self.odometry.take(event) {
            self.begin_anew();
        }
        if let Event::Scan(scan) = event
            && scan.laser == LaserId::FIRST
        {
            self.scan(scan);
        }
    }

    /// Forgets what was seen and how the vehicle moved; a search that is under way is given up.
    pub fn forget(&mut self) {
        self.odometry.forget();
        self.begin_anew();
    }

    fn begin_anew(&mut self) {
        self.begun = None;
        self.last = None;
    }

    fn scan(&mut self, scan: &Scan) {
        match self.odometry.see(Some(scan.end())) {
            Sight::Usable => {}
            Sight::Anew => self.begin_anew(),
            Sight::Useless => return,
        }
        let (None, Some(mount)) = (self.begun, self.parameters.lasers.mount(scan.laser)) else { return };
        let recent = self.odometry.recent();
        self.places.begin(scan, mount, recent, &self.parameters.features);
        // The points are in the frame of the laser at the first beam.
        let laser = recent.pose_at(scan.start).compose(mount);
        self.begun = Some((*self.odometry.pose(), laser));
    }

    /// Goes on with the search that is under way, if one is, until about `effort` is spent: see
    /// [`crate::contours::PlaceSearch::advance`].
    pub fn search(&mut self, map: &P::Map, room: &mut P::Room, effort: u32) -> StartState {
        let Some((odometry, laser)) = self.begun else { return StartState::Waiting };
        let answer = match self.places.advance(map, room, effort) {
            PlaceProgress::Searching => return StartState::Searching,
            PlaceProgress::Done(answer) => answer,
        };
        self.begun = None;
        // R when the search began, and now.
        let since = laser.inverse().compose(&odometry.between(self.odometry.pose()));
        let now = |place: &PlaceFix| place.pose.compose(&since);
        match answer {
            PlaceAnswer::Found(place) => {
                let look = Look { pose: now(&place), odometry: *self.odometry.pose() };
                let is_same = |last: &Look| {
                    let off = last.pose.compose(&last.odometry.between(&look.odometry)).between(&look.pose);
                    libm::hypot(off.x, off.y) < SAME.0 && libm::fabs(off.theta) < SAME.1
                };
                let before = self.last.filter(|(last, _)| is_same(last)).map_or(0, |(_, looks)| looks);
                let looks = before.saturating_add(1);
                self.last = Some((look, looks));
                let fix = self.fix(&place, look.pose);
                if looks >= LOOKS { StartState::Found(fix) } else { StartState::Unconfirmed(fix) }
            }
            PlaceAnswer::Ambiguous(one, other) => {
                self.last = None;
                StartState::Ambiguous(now(&one), now(&other))
            }
            PlaceAnswer::TooFew => {
                self.last = None;
                StartState::TooFew
            }
            PlaceAnswer::Unknown => {
                self.last = None;
                StartState::Unknown
            }
        }
    }

    fn fix(&self, place: &PlaceFix, pose: Pose) -> PoseFix {
        let covariance = place.information.try_inverse().unwrap_or_else(Matrix3::zeros) * INFLATION;
        let position = libm::sqrt(covariance.m11.max(covariance.m22));
        PoseFix {
            time: self.odometry.recent().end(),
            pose,
            position_deviation: position.max(LEAST_DEVIATION.0),
            heading_deviation: libm::sqrt(covariance.m33).max(LEAST_DEVIATION.1),
        }
    }
}

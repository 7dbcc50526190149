//! Contours: the pose under which the surfaces of a scan lie on those of a kept map.
//!
//! The same memory serves those of the way behind: `contours_behind.rs`.

use core::fmt::Debug;

use heapless::Vec;
use nalgebra::{Matrix3, Vector3};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::places::{FindPlaces, NoPlaces, Places};
use crate::contours::{
    ContourMatch, KeptMap, KeptMapError, KeyRing, Prediction, Submap, SurfacePoint, Surroundings, align, align_nearby,
    find_surface_points,
};
use crate::filter::{Ekf, PoseObservation};
use crate::geometry::Pose;
use crate::maps::Verdict;
use crate::sensing::PointView;

/// By what the covariance of a match is multiplied that takes points as independent.
pub(super) const INFLATION: f64 = 3.0;

/// Standard deviation along each axis of what all scans of a map have in common, m.
const SHARED_POSITION: f64 = 0.005;

/// The same for the heading, rad.
const SHARED_HEADING: f64 = 1e-3;

/// Standard deviation along a free axis, m: as good as nothing.
pub(super) const FREE: f64 = 100.0;

/// Chi-square with three degrees of freedom, 99.9 per cent: what is further from the pose surprises.
pub(super) const GATE: f64 = 16.3;

/// If fewer of a scan's points lie on surfaces, the map does not say where it was taken.
pub(super) const LEAST_SHARE: f32 = 0.3;

/// A place is as good as another one if its share of points on surfaces is no less than this much of the other's.
const AS_GOOD: f32 = 0.9;

/// Places of the laser that are further apart than this, m and rad, are two.
const APART: (f64, f64) = (0.1, 0.05);

/// What finds a scan in a kept map, or among the last `KEYS` key scans, with room for `ROOM` points of the surroundings and `POINTS` of a
/// scan; the map is lent for `'m`.
#[derive(Clone, Debug)]
pub struct Contours<'m, const POINTS: usize = 400, const ROOM: usize = 6144, const KEYS: usize = 20> {
    map: Option<KeptMap<'m>>,
    points: Vec<SurfacePoint, POINTS>,
    around: Around<POINTS, ROOM, KEYS>,
}

/// What is loaded of a map, and the key scans that lie over it, or are there instead.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Around<const POINTS: usize, const ROOM: usize, const KEYS: usize> {
    surroundings: Surroundings<ROOM>,
    keys: KeyRing<KEYS, POINTS>,
}

/// A vehicle that has no room for contours.
#[derive(Clone, Copy, Debug)]
pub struct NoContours;

/// Who takes a map of contours as the bytes of somebody else, for `'m`.
pub trait LendContours<'m>: FindContours {
    /// Takes bytes as the map, instead of the one before.
    ///
    /// # Errors
    /// See [`KeptMapError`]; the map is as before then.
    fn lend(&mut self, bytes: &'m [u8]) -> Result<(), KeptMapError>;
}

impl<'m, const POINTS: usize, const ROOM: usize, const KEYS: usize> LendContours<'m>
    for Contours<'m, POINTS, ROOM, KEYS>
{
    fn lend(&mut self, bytes: &'m [u8]) -> Result<(), KeptMapError> {
        self.set_map(Some(KeptMap::read(bytes)?));
        Ok(())
    }
}

impl<'m> LendContours<'m> for NoContours {
    fn lend(&mut self, _: &'m [u8]) -> Result<(), KeptMapError> {
        Err(KeptMapError::NoRoom)
    }
}

/// [`Contours`] of any capacity, or none.
pub trait FindContours: Clone + Debug {
    /// A map as it is lent.
    type Map: Copy + Debug;

    /// What searches a start in the map.
    type Places: FindPlaces<Map = Self::Map>;

    /// What it knows of what is around, beside the map.
    type Around: Serialize + DeserializeOwned;

    /// Points of the surroundings, at the most.
    const POINTS: usize;

    /// Key scans of the way behind, at the most.
    const KEYS: usize;

    /// One without a map.
    fn new() -> Self;

    /// Takes another map, or none.
    fn set_map(&mut self, map: Option<Self::Map>);

    /// The map.
    fn map(&self) -> Option<Self::Map>;

    /// Whether there is a map.
    fn has_map(&self) -> bool {
        self.map().is_some()
    }

    /// The map, and memory for who searches a start in it. What was loaded is loaded anew afterwards.
    fn for_search(&mut self) -> Option<(Self::Map, &mut <Self::Places as FindPlaces>::Room)>;

    /// The vehicle is elsewhere: what is around is loaded anew when the next scan is compared with the map, and what was learnt beside the
    /// map is forgotten.
    fn begin_anew(&mut self);

    /// Takes the points of a scan and finds where it was taken. None if the map says nothing of it.
    fn locate(&mut self, scan: PointView<'_>, predicted: &Prediction) -> Option<ContourMatch>;

    /// Learns what of the scan taken last, from a pose of its points that is known that well (m and rad), is not of the map.
    fn learn(&mut self, pose: &Pose, deviation: (f64, f64));

    /// Where the scan taken last fits nearest to a pose, without a search.
    fn locate_nearby(&self, predicted: &Pose) -> Option<ContourMatch>;

    /// Takes the points of a scan.
    fn see(&mut self, scan: PointView<'_>);

    /// Where the scan taken last was taken by the key scans of the way behind, which are there instead of a map. None if they say
    /// nothing of it.
    fn locate_behind(&self, predicted: &Prediction) -> Option<ContourMatch>;

    /// Forgets the key scans.
    fn forget_keys(&mut self);

    /// Makes the scan taken last a key scan if its laser, at `pose`, is far enough from that of the newest one. Returns whether it was.
    fn keep(&mut self, pose: &Pose) -> bool;

    /// Whether there was no room for all of the surroundings.
    fn has_cut(&self) -> bool;

    /// What is around, as it is stored.
    fn around(&self) -> &Self::Around;

    /// Takes what is around from where it was stored.
    fn set_around(&mut self, around: Self::Around);
}

impl<'m, const POINTS: usize, const ROOM: usize, const KEYS: usize> FindContours for Contours<'m, POINTS, ROOM, KEYS> {
    type Map = KeptMap<'m>;
    type Places = Places<'m, POINTS, ROOM>;
    type Around = Around<POINTS, ROOM, KEYS>;

    const POINTS: usize = ROOM;
    const KEYS: usize = KEYS;

    #[inline(always)]
    fn new() -> Self {
        let around = Around { surroundings: Surroundings::new(), keys: KeyRing::new() };
        Self { map: None, points: Vec::new(), around }
    }

    fn set_map(&mut self, map: Option<KeptMap<'m>>) {
        self.map = map;
        self.around.surroundings.load_anew();
        self.around.keys.clear();
    }

    fn map(&self) -> Option<KeptMap<'m>> {
        self.map
    }

    fn for_search(&mut self) -> Option<(KeptMap<'m>, &mut Submap<ROOM>)> {
        Some((self.map?, self.around.surroundings.lend()))
    }

    fn begin_anew(&mut self) {
        self.around.surroundings.load_anew();
        if self.map.is_some() {
            self.around.keys.clear();
        }
    }

    #[inline(never)]
    fn locate(&mut self, scan: PointView<'_>, predicted: &Prediction) -> Option<ContourMatch> {
        self.see(scan);
        self.around.surroundings.align((&self.map?, &self.around.keys), &self.points, predicted)
    }

    #[inline(never)]
    fn learn(&mut self, pose: &Pose, deviation: (f64, f64)) {
        if let Some(map) = &self.map {
            let deviation = [deviation.0 as f32, deviation.1 as f32];
            self.around.surroundings.learn((map, &mut self.around.keys), &self.points, (pose, deviation));
        }
    }

    fn locate_nearby(&self, predicted: &Pose) -> Option<ContourMatch> {
        align_nearby(&self.points, self.around.surroundings.loaded(), predicted)
    }

    fn see(&mut self, scan: PointView<'_>) {
        find_surface_points(scan, &mut self.points);
    }

    #[inline(never)]
    fn locate_behind(&self, predicted: &Prediction) -> Option<ContourMatch> {
        align(&self.points, self.around.surroundings.loaded(), predicted)
    }

    fn forget_keys(&mut self) {
        self.around.keys.clear();
    }

    #[inline(never)]
    fn keep(&mut self, pose: &Pose) -> bool {
        let is_kept = self.around.keys.wants(pose);
        if is_kept {
            self.around.keys.keep(pose, [0.0; 2], self.points.iter().copied());
            self.around.surroundings.of_keys(pose, &self.around.keys);
        }
        is_kept
    }

    fn has_cut(&self) -> bool {
        self.around.surroundings.loaded().has_cut()
    }

    fn around(&self) -> &Around<POINTS, ROOM, KEYS> {
        &self.around
    }

    fn set_around(&mut self, around: Around<POINTS, ROOM, KEYS>) {
        self.around = around;
    }
}

impl FindContours for NoContours {
    type Map = core::convert::Infallible;
    type Places = NoPlaces;
    type Around = ();

    const POINTS: usize = 0;
    const KEYS: usize = 0;

    fn new() -> Self {
        Self
    }

    fn set_map(&mut self, _: Option<Self::Map>) {}

    fn map(&self) -> Option<Self::Map> {
        None
    }

    fn for_search(&mut self) -> Option<(Self::Map, &mut Self::Map)> {
        None
    }

    fn begin_anew(&mut self) {}

    fn locate(&mut self, _: PointView<'_>, _: &Prediction) -> Option<ContourMatch> {
        None
    }

    fn learn(&mut self, _: &Pose, _: (f64, f64)) {}

    fn locate_nearby(&self, _: &Pose) -> Option<ContourMatch> {
        None
    }

    fn see(&mut self, _: PointView<'_>) {}

    fn locate_behind(&self, _: &Prediction) -> Option<ContourMatch> {
        None
    }

    fn forget_keys(&mut self) {}

    fn keep(&mut self, _: &Pose) -> bool {
        false
    }

    fn has_cut(&self) -> bool {
        false
    }

    fn around(&self) -> &() {
        &()
    }

    fn set_around(&mut self, (): ()) {}
}

/// Where R is by a match of a scan whose points are in the frame of a laser mounted at `mount` in R. None if its information is no
/// matrix of one.
#[must_use]
pub fn pose_by_contours(found: &ContourMatch, mount: &Pose) -> Option<PoseObservation> {
    let free = Matrix3::from_diagonal_element(1.0 / (FREE * FREE));
    // What has been learnt beside the map is as wrong as the pose was then.
    let [position, heading] = found.of_overlay.map(f64::from);
    let position = SHARED_POSITION * SHARED_POSITION + position * position;
    let shared = [position, position, SHARED_HEADING * SHARED_HEADING + heading * heading];
    let own = (found.information / INFLATION + free).try_inverse()?;
    let back = mount.inverse();
    // Position and heading of the laser are those of R with the lever between them.
    let jacobian = found.pose.compose_jacobian_first(&back);
    let of = jacobian * (own + Matrix3::from_diagonal(&Vector3::from(shared))) * jacobian.transpose();
    let covariance = [of.m11, of.m12, of.m22, of.m13, of.m23, of.m33];
    Some(PoseObservation { pose: found.pose.compose(&back), covariance, shared, widening: 1.0 })
}

/// What became of a scan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ContourOutcome {
    pub verdict: Verdict,
    /// Squared Mahalanobis distance from the pose over the gate; none if nothing was compared.
    pub test_ratio: Option<f64>,
    /// Where R is by the scan.
    pub seen: Option<PoseObservation>,
}

impl ContourOutcome {
    /// It says nothing.
    const NOTHING: Self = Self { verdict: Verdict::Unknown, test_ratio: None, seen: None };

    /// A pose that is compared with a state. One that surprises makes what was known before count for little: steps of an odometry are
    /// now and then wrong by far more than their deviation says.
    fn new(seen: PoseObservation, state: &Ekf) -> Self {
        let Some(square) = seen.normalised_square(state) else { return Self::NOTHING };
        let widening = if square > GATE { 1.0 + 0.25 * square } else { 1.0 };
        let seen = PoseObservation { widening, ..seen };
        Self { verdict: Verdict::Accepted, test_ratio: Some(square / GATE), seen: Some(seen) }
    }

    fn is_expected(&self) -> bool {
        self.test_ratio.is_none_or(|ratio| ratio <= 1.0)
    }

    /// Whether it was compared with a pose that is known better, and agrees with it.
    pub(crate) fn agrees(&self) -> bool {
        self.verdict == Verdict::Unknown && self.test_ratio.is_some_and(|ratio| ratio <= 1.0)
    }

    /// The pose that is to correct the filter, if one is.
    pub(crate) fn wanted(&self) -> Option<PoseObservation> {
        self.seen.filter(|_| self.verdict == Verdict::Accepted)
    }
}

/// Finds where R was, which was about at the pose of `state`; the frame of the scan's points is at `mount` in R, and `step` is the
/// motion since the scan before. Where something better `leads`, it is compared and not used.
pub(crate) fn see_contours(
    contours: &mut impl FindContours,
    scan: PointView<'_>,
    mount: &Pose,
    (state, step): (&Ekf, &Pose),
    leads: bool,
) -> ContourOutcome {
    let pose = state.pose.compose(mount);
    let predicted = Prediction::of_filter(pose, state.position_deviation(), state.heading_deviation(), step);
    let Some(found) = contours.locate(scan, &predicted).filter(|found| found.share >= LEAST_SHARE) else {
        return ContourOutcome::NOTHING;
    };
    let compared = |found: &ContourMatch| {
        pose_by_contours(found, mount).map_or(ContourOutcome::NOTHING, |seen| ContourOutcome::new(seen, state))
    };
    let usual = compared(&found);
    if leads {
        let verdict = if usual.is_expected() { Verdict::Unknown } else { Verdict::Gated };
        return ContourOutcome { verdict, ..usual };
    }
    if usual.is_expected() {
        return usual;
    }
    // Surfaces that repeat fit in two places. The one where the vehicle should be is right if it is as good.
    let as_good = contours.locate_nearby(&predicted.pose).filter(|near| near.share >= AS_GOOD * found.share);
    let Some(near) = as_good.filter(|near| is_elsewhere(&near.pose, &found.pose)) else { return usual };
    let near = compared(&near);
    let verdict = if near.is_expected() { near.verdict } else { Verdict::Ambiguous };
    ContourOutcome { verdict, ..near }
}

/// Whether two poses are not the same place.
fn is_elsewhere(one: &Pose, other: &Pose) -> bool {
    let apart = one.between(other);
    libm::hypot(apart.x, apart.y) > APART.0 || libm::fabs(apart.theta) > APART.1
}

//! Where a laser is by the surfaces of the distance behind.

use heapless::Vec;
use nalgebra::Matrix3;

use super::refinement::Refining;
use super::{KeyRing, Prediction, Refinement, SearchWindow, Submap, SurfacePoint, find_surface_points, refine, search};
use crate::geometry::{Pose, ScanPoint, Transform};
use crate::sensing::PointView;

/// If the surfaces say less than this share along one axis of what they say across it, that axis is free.
const LEAST_SHARE: f32 = 0.03;

/// If fewer of the points lie on surfaces, the pose is looked for further away.
const POOR_SHARE: f32 = 0.5;

/// What is found further away is believed if so many do, and twice as many as nearby.
const SURE_SHARE: f32 = 0.7;

/// What the surfaces say of the pose of the laser.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContourMatch {
    /// Pose of the laser. Along the free axis it is the predicted one.
    pub pose: Pose,
    /// Inverse of the covariance (x, y, theta) if points err independently; nothing along the free axis.
    pub information: Matrix3<f64>,
    /// The unit vector along which the surfaces do not say where the laser is, as in a corridor.
    pub free_axis: Option<ScanPoint>,
    /// Length of the mean of the normals, weighted: 1 if all surfaces face the same way, 0 in a corridor.
    pub facing: f32,
    /// Share of the scan's points that lie on surfaces.
    pub share: f32,
    /// Mean square of their distances from the surfaces in that which `information` takes it to be.
    pub scatter: f32,
    /// What of its error is that of an overlay: standard deviation of the position along an axis, m, and of the heading, rad.
    pub of_overlay: [f32; 2],
}

/// Surfaces of the last `KEYS` key scans of at most `POINTS` points, and of the present one, in a submap with room for `ROOM`.
#[derive(Clone, Debug)]
pub struct ContourMatcher<const POINTS: usize = 400, const KEYS: usize = 20, const ROOM: usize = 4096> {
    points: Vec<SurfacePoint, POINTS>,
    ring: KeyRing<KEYS, POINTS>,
    submap: Submap<ROOM>,
}

impl<const POINTS: usize, const KEYS: usize, const ROOM: usize> ContourMatcher<POINTS, KEYS, ROOM> {
    /// Nothing has been seen.
    #[must_use]
    pub const fn new() -> Self {
        Self { points: Vec::new(), ring: KeyRing::new(), submap: Submap::new() }
    }

    /// Forgets all.
    pub fn clear(&mut self) {
        self.points.clear();
        self.ring.clear();
        self.submap.begin(&Pose::default());
    }

    /// The points of the present scan, in the frame of its points.
    #[must_use]
    pub fn points(&self) -> &[SurfacePoint] {
        &self.points
    }

    /// The surfaces that are matched with.
    #[must_use]
    pub const fn submap(&self) -> &Submap<ROOM> {
        &self.submap
    }

    /// Takes the points of a scan.
    pub fn see(&mut self, scan: PointView<'_>) {
        find_surface_points(scan, &mut self.points);
    }

    /// Where the scan was taken, if the prediction is not too far off. None if it says nothing.
    #[must_use]
    pub fn align(&self, predicted: &Prediction) -> Option<ContourMatch> {
        align(&self.points, &self.submap, predicted)
    }

    /// Makes the scan a key scan if it was taken far enough from the newest one. Returns whether it was.
    pub fn keep(&mut self, pose: &Pose) -> bool {
        let is_kept = self.ring.wants(pose);
        if is_kept {
            self.ring.keep(pose, [0.0; 2], self.points.iter().copied());
            self.submap.surround(pose, &self.ring);
        }
        is_kept
    }
}

impl<const POINTS: usize, const KEYS: usize, const ROOM: usize> Default for ContourMatcher<POINTS, KEYS, ROOM> {
    fn default() -> Self {
        Self::new()
    }
}

/// The pose of points in any submap: search, refinement, and a free axis that stays where the prediction has it.
#[must_use]
pub fn align<const ROOM: usize>(
    points: &[SurfacePoint],
    map: &Submap<ROOM>,
    predicted: &Prediction,
) -> Option<ContourMatch> {
    let inside = map.origin().between(&predicted.pose);
    let look = |window: &SearchWindow| {
        let start = search(points, map.grid(), &inside, window).pose;
        refine(points, map, &start)
    };
    let usual = look(&predicted.window());
    let is_poor = usual.is_none_or(|found| share(points, &found) < POOR_SHARE);
    let wide = if is_poor { look(&SearchWindow::WIDE) } else { None };
    let nearby = usual.map_or(0, |found| found.inliers);
    let is_sure = |far: &Refinement| share(points, far) > SURE_SHARE && far.inliers > 2 * nearby;
    let found = wide.filter(is_sure).or(usual)?;
    Some(in_map(points, map, &inside, &found))
}

/// The same without a search: the pose nearest to the prediction.
#[must_use]
pub fn align_nearby<const ROOM: usize>(
    points: &[SurfacePoint],
    map: &Submap<ROOM>,
    predicted: &Pose,
) -> Option<ContourMatch> {
    let inside = map.origin().between(predicted);
    let found = refine(points, map, &inside)?;
    Some(in_map(points, map, &inside, &found))
}

/// A match in a submap, moved to where the points lie on surfaces further away as well, which `nearest` gives in the frame of the submap: from
/// where it has them and from where they were predicted, as a thing nearby that was moved takes the match along. None if all of them are in
/// the submap.
pub(super) fn settle<const ROOM: usize>(
    points: &[SurfacePoint],
    map: &Submap<ROOM>,
    predicted: &Pose,
    found: &ContourMatch,
    nearest: impl Fn(&SurfacePoint, f32) -> Option<SurfacePoint>,
) -> Option<ContourMatch> {
    let start = map.origin().between(&found.pose);
    let transform = Transform::of(&start);
    let is_beyond = |point: &SurfacePoint| !map.holds(&point.moved(&transform).position);
    if !points.iter().any(is_beyond) {
        return None;
    }
    let inside = map.origin().between(predicted);
    let [matched, expected] = [start, inside].map(|start| Refining::near(start).run(points, &nearest));
    let inliers = |settled: &Option<Refinement>| settled.map_or(0, |settled| settled.inliers);
    let settled = if inliers(&matched) > inliers(&expected) { matched } else { expected }?;
    Some(in_map(points, map, &inside, &settled))
}

/// Share of the points that lie on surfaces.
fn share(points: &[SurfacePoint], found: &Refinement) -> f32 {
    found.inliers as f32 / points.len().max(1) as f32
}

/// What was found in the frame of a submap, in that of the map. Along an axis of which the surfaces say nothing it is where it was
/// predicted, `inside` the submap.
fn in_map<const ROOM: usize>(
    points: &[SurfacePoint],
    map: &Submap<ROOM>,
    inside: &Pose,
    found: &Refinement,
) -> ContourMatch {
    let free_axis = weak_axis(found.directions);
    let mut pose = found.pose;
    let mut information = found.information;
    if let Some(axis) = free_axis {
        let along = f64::from(axis.x) * (inside.x - pose.x) + f64::from(axis.y) * (inside.y - pose.y);
        pose.x += f64::from(axis.x) * along;
        pose.y += f64::from(axis.y) * along;
        information = without(information, axis);
    }
    ContourMatch {
        pose: map.origin().compose(&pose),
        information,
        free_axis,
        facing: found.facing,
        share: share(points, found),
        scatter: found.scatter,
        of_overlay: [0.0; 2],
    }
}

/// The axis along which the normals say least, if that is too little.
pub(super) fn weak_axis([xx, xy, yy]: [f32; 3]) -> Option<ScanPoint> {
    let (trace, gap) = (xx + yy, libm::sqrtf((xx - yy) * (xx - yy) + 4.0 * xy * xy));
    if trace - gap >= LEAST_SHARE * (trace + gap) {
        return None;
    }
    // Half of the angle of the strong axis, a quarter of a turn on.
    let strong = 0.5 * libm::atan2f(2.0 * xy, xx - yy);
    let (sine, cosine) = libm::sincosf(strong);
    Some(ScanPoint::new(-sine, cosine))
}

/// An information matrix from which all is taken that it says along an axis.
fn without(information: Matrix3<f64>, axis: ScanPoint) -> Matrix3<f64> {
    let (x, y) = (f64::from(axis.x), f64::from(axis.y));
    let projection = Matrix3::new(1.0 - x * x, -x * y, 0.0, -x * y, 1.0 - y * y, 0.0, 0.0, 0.0, 1.0);
    projection * information * projection
}

//! The pose under which the points of a scan lie on surfaces: points to lines, iterated, robustly weighted.

use core::num::NonZeroUsize;

use nalgebra::{Matrix3, Vector3};

use super::contour_length::ContourLengths;
use super::{Submap, SurfacePoint};
use crate::geometry::{Pose, ScanPoint, Transform, difference, wrap};

/// Most iterations.
const ITERATIONS: usize = 8;

/// Iterations in which surfaces are looked for far away.
const FAR_ITERATIONS: usize = 2;

/// How far a surface is looked for, m: at first, and then.
const REACH: (f32, f32) = (0.3, 0.15);

/// Points further from their surface than this weigh half, m: at first, and at least.
const TOLERANCE: (f32, f32) = (0.05, 0.015);

/// Later it is so many times their distance, root mean square, weighted.
const TOLERATED: f32 = 2.5;

/// Standard deviation of a point across its surface, m.
const DEVIATION: f32 = 0.03;

/// Weight of a corner along each axis beside that of a point on a line.
const CORNER: f32 = 0.6;

/// How far the start may be wrong: standard deviation of the position, m, and of the heading, rad.
const START: (f64, f64) = (0.05, 0.02);

/// Steps shorter than this, m and rad, end the iteration.
const SMALL: f64 = 2e-4;

/// Fewest points that fix a pose.
const FEWEST: u32 = 10;

/// What the surfaces say of a pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Refinement {
    /// The pose in the frame of the submap.
    pub pose: Pose,
    /// Inverse of the covariance (x, y, theta) if points err independently; each counts by the length of contour that it stands for, in their
    /// mean as one.
    pub information: Matrix3<f64>,
    /// The sum of the outer products of the normals with themselves, weighted: xx, xy, yy.
    pub directions: [f32; 3],
    /// Length of the mean of the normals, weighted: 1 if all surfaces face the same way, 0 in a corridor.
    pub facing: f32,
    /// Points that lie on surfaces.
    pub inliers: u32,
    /// Mean square of their distances from the surfaces, weighted, in that which `information` takes it to be.
    pub scatter: f32,
}

/// Sums over points.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    information: [f32; 6],
    gradient: [f32; 3],
    directions: [f32; 3],
    facing: ScanPoint,
    inliers: u32,
    /// Length of contour for which the inliers stand, m.
    length: f32,
    weights: f32,
    squares: f32,
}

impl Sums {
    /// Adds one equation: `distance` along `normal` for a point with that lever.
    fn add(&mut self, normal: ScanPoint, lever: ScanPoint, distance: f32, weight: f32) {
        let row = [normal.x, normal.y, lever.x * normal.y - lever.y * normal.x];
        let weighted = row.map(|entry| entry * weight);
        let [xx, xy, xt, yy, yt, tt] = &mut self.information;
        *xx += weighted[0] * row[0];
        *xy += weighted[0] * row[1];
        *xt += weighted[0] * row[2];
        *yy += weighted[1] * row[1];
        *yt += weighted[1] * row[2];
        *tt += weighted[2] * row[2];
        for (sum, entry) in self.gradient.iter_mut().zip(weighted) {
            *sum += entry * distance;
        }
        self.weights += weight;
        self.squares += weight * distance * distance;
        self.directions[0] += weighted[0] * row[0];
        self.directions[1] += weighted[0] * row[1];
        self.directions[2] += weighted[1] * row[1];
    }

    /// Adds what a point says that stands for so much contour, m, and was moved by a transform to where that surface is near.
    fn lay(
        &mut self,
        (moved, length): (&SurfacePoint, f32),
        surface: &SurfacePoint,
        (transform, tolerance): (&Transform, f32),
    ) {
        let (lever, error) = (moved.position - transform.shift(), moved.position - surface.position);
        let weight = |square: f32| length / ((1.0 + square / (tolerance * tolerance)) * DEVIATION * DEVIATION);
        self.inliers += 1;
        self.length += length;
        if surface.is_corner() {
            let weight = CORNER * weight(error.norm_squared());
            self.add(ScanPoint::new(1.0, 0.0), lever, error.x, weight);
            self.add(ScanPoint::new(0.0, 1.0), lever, error.y, weight);
        } else {
            let distance = surface.normal.dot(&error);
            let weight = weight(distance * distance);
            self.facing += surface.normal * weight;
            self.add(surface.normal, lever, distance, weight);
        }
    }

    /// See [`Refinement::facing`].
    fn facing(&self) -> f32 {
        self.facing.norm() / self.weights.max(f32::MIN_POSITIVE)
    }

    /// See [`Refinement::scatter`].
    fn scatter(&self) -> f32 {
        self.squares / (self.weights.max(f32::MIN_POSITIVE) * DEVIATION * DEVIATION)
    }

    /// By this factor the mean inlier counts as one.
    fn scale(&self) -> f32 {
        self.inliers as f32 / self.length.max(f32::MIN_POSITIVE)
    }

    fn directions(&self) -> [f32; 3] {
        self.directions.map(|entry| entry * self.scale())
    }

    fn gradient(&self) -> Vector3<f64> {
        Vector3::from(self.gradient.map(f64::from)) * f64::from(self.scale())
    }

    fn information(&self) -> Matrix3<f64> {
        let [xx, xy, xt, yy, yt, tt] = self.information.map(|entry| f64::from(entry) * f64::from(self.scale()));
        Matrix3::new(xx, xy, xt, xy, yy, yt, xt, yt, tt)
    }
}

/// Moving a scan to where its points lie on surfaces, some points at a time.
#[derive(Clone, Copy, Debug)]
pub(super) struct Refining {
    start: Pose,
    pose: Pose,
    iteration: usize,
    tolerance: f32,
    /// What was summed up in this iteration, of so many points.
    sums: Sums,
    points: usize,
    /// One of so many points is taken.
    stride: NonZeroUsize,
    outcome: Option<Refinement>,
}

impl Refining {
    /// A scan that is taken to be at `start` in the frame of the map.
    pub(super) fn new(start: Pose) -> Self {
        Self {
            start,
            pose: start,
            iteration: 0,
            tolerance: TOLERANCE.0,
            sums: Sums::default(),
            points: 0,
            stride: NonZeroUsize::MIN,
            outcome: None,
        }
    }

    /// The same by one of `stride` points each.
    pub(super) fn by_some(start: Pose, stride: NonZeroUsize) -> Self {
        Self { stride, ..Self::new(start) }
    }

    /// A scan that was laid onto some of the surfaces at `start`: the others are not far away.
    pub(super) fn near(start: Pose) -> Self {
        Self { iteration: FAR_ITERATIONS, ..Self::new(start) }
    }

    /// Iterates to the end.
    pub(super) fn run(
        mut self,
        points: &[SurfacePoint],
        nearest: impl Fn(&SurfacePoint, f32) -> Option<SurfacePoint>,
    ) -> Option<Refinement> {
        for _ in 0..ITERATIONS {
            if !self.step(points, points.len(), &nearest) {
                break;
            }
        }
        self.outcome()
    }

    /// What was found so far.
    pub(super) fn outcome(&self) -> Option<Refinement> {
        self.outcome.filter(|found| found.pose.is_finite())
    }

    /// Takes at most `count` points, and iterates when it has seen all of them; whether there is more to do. `nearest` gives the surface
    /// that is nearest to a point within so many metres.
    pub(super) fn step(
        &mut self,
        points: &[SurfacePoint],
        count: usize,
        mut nearest: impl FnMut(&SurfacePoint, f32) -> Option<SurfacePoint>,
    ) -> bool {
        let transform = Transform::of(&self.pose);
        let reach = if self.iteration < FAR_ITERATIONS { REACH.0 } else { REACH.1 };
        let stride = self.stride.get();
        let first = self.points.saturating_mul(stride);
        let mut lengths = ContourLengths::new(points);
        for (index, point) in points.iter().enumerate().skip(first).step_by(stride).take(count) {
            let moved = point.moved(&transform);
            if let Some(surface) = nearest(&moved, reach) {
                self.sums.lay((&moved, lengths.at(index)), &surface, (&transform, self.tolerance));
            }
        }
        self.points = self.points.saturating_add(count);
        if self.points < points.len().div_ceil(stride) {
            return true;
        }
        self.points = 0;
        let sums = core::mem::take(&mut self.sums);
        let goes_on = self.try_move(&sums);
        if goes_on.is_none() {
            self.outcome = None;
        }
        goes_on.unwrap_or(false)
    }

    /// None if too few points lie on surfaces.
    fn try_move(&mut self, sums: &Sums) -> Option<bool> {
        let (position, heading) = (1.0 / (START.0 * START.0), 1.0 / (START.1 * START.1));
        let Self { start, pose, iteration, .. } = *self;
        if sums.inliers < FEWEST {
            return None;
        }
        let information = sums.information();
        let prior = Vector3::new(position, position, heading);
        let moved = Vector3::new(pose.x - start.x, pose.y - start.y, difference(pose.theta, start.theta));
        let gradient = sums.gradient() + prior.component_mul(&moved);
        let step = (information + Matrix3::from_diagonal(&prior)).try_inverse()? * gradient;
        let pose = Pose { x: pose.x - step.x, y: pose.y - step.y, theta: wrap(pose.theta - step.z) };
        self.pose = pose;
        self.iteration += 1;
        // The next one may be the last.
        if self.iteration >= FAR_ITERATIONS {
            let distance = DEVIATION * libm::sqrtf(sums.scatter());
            self.tolerance = (TOLERATED * distance).clamp(TOLERANCE.1, TOLERANCE.0);
        }
        self.outcome = Some(Refinement {
            pose,
            information,
            directions: sums.directions(),
            facing: sums.facing(),
            inliers: sums.inliers,
            scatter: sums.scatter(),
        });
        let is_settled = iteration >= FAR_ITERATIONS && step.amax() < SMALL;
        Some(!is_settled && self.iteration < ITERATIONS)
    }
}

/// Moves a scan, which is taken to be at `start` in the frame of the submap, to where its points lie on surfaces. None if too few do.
#[must_use]
pub fn refine<const ROOM: usize>(points: &[SurfacePoint], map: &Submap<ROOM>, start: &Pose) -> Option<Refinement> {
    Refining::new(*start).run(points, |point, reach| map.nearest(point, reach))
}

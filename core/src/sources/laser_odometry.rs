//! Laser odometry: where the first laser has gone since landmarks last told its pose, by the surfaces around it alone.
//!
//! It corrects nothing. Where no landmark is in sight, only it can contradict the odometry of the wheels: each scan is matched to those
//! behind it, and the wheels tell no more than where to look for it.

use serde::{Deserialize, Serialize};

use super::FindContours;
use super::contours::LEAST_SHARE;
use crate::contours::Prediction;
use crate::geometry::Pose;

/// Landmarks of a fixed map that tell a pose.
const TELLING: usize = 2;

/// Where more are seen, one revolution does not lose sight of all of them but one.
const FEW: usize = 3;

/// Scans in a row that lie on no surface seen before, until those behind them are given up: what hides the surfaces passes by.
const GIVEN_UP: u8 = 2;

/// The laser when its last scan began.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Reached {
    /// By surfaces, in W as landmarks last told it.
    by_surfaces: Pose,
    /// In the frame of the odometry.
    by_odometry: Pose,
    /// How far it has gone since landmarks told its pose, m.
    distance: f64,
    /// Scans in a row that lay on no surface seen before.
    missed: u8,
    /// Whether those behind were given up since landmarks told the pose.
    is_torn: bool,
    /// Whether surfaces left an axis free since then.
    is_led_by_wheels: bool,
}

/// Where R is by surfaces.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BySurfaces {
    /// In W.
    pub pose: Pose,
    /// How far the laser has gone since landmarks told its pose, m.
    pub distance: f64,
    /// Whether there was a step on which surfaces did not show how it has moved.
    pub is_torn: bool,
    /// Whether there was one on which they did not show it along an axis, as in a corridor: there the wheels have led.
    pub is_led_by_wheels: bool,
    /// The displacement of R by the wheels since its last scan began, which no surface has shown yet.
    pub since: Pose,
}

/// What it has reached.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(crate) struct LaserOdometry {
    /// Landmarks that were used in the present revolution.
    used: usize,
    reached: Option<Reached>,
}

/// A laser as it is when a scan begins.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LaserAtStart {
    /// In W.
    pub in_world: Pose,
    /// In the frame of the odometry.
    pub by_odometry: Pose,
}

impl LaserOdometry {
    pub(crate) const fn new() -> Self {
        Self { used: 0, reached: None }
    }

    /// Nothing is known of where it was.
    pub(crate) const fn stop(&mut self) {
        *self = Self::new();
    }

    /// Takes how many landmarks of a fixed map the reflectors of a revolution have used, whether the scan of the one before has come or not.
    pub(crate) const fn use_reflectors(&mut self, count: usize) {
        self.used = count;
    }

    /// Takes how many landmarks of a fixed map the scan of that revolution has used.
    pub(crate) const fn use_features(&mut self, count: usize) {
        self.used = self.used.saturating_add(count);
    }

    /// Whether landmarks alone lead, so that no scan is needed.
    pub(crate) const fn is_led(&self) -> bool {
        self.used > FEW
    }

    /// Takes a scan, whose points the contours have seen.
    pub(crate) fn follow(&mut self, contours: &mut impl FindContours, laser: &LaserAtStart) {
        let is_told = core::mem::take(&mut self.used) >= TELLING;
        let reached = match self.reached.filter(|_| !is_told) {
            Some(before) => before.go_on(contours, laser),
            None => Reached::begin(contours, laser),
        };
        self.reached = Some(reached);
    }

    /// Where R is now; `odometry_pose` is where it is in the frame of the odometry, and `mount` the pose of S in R. None where landmarks lead.
    pub(crate) fn pose(&self, odometry_pose: &Pose, mount: &Pose) -> Option<BySurfaces> {
        let reached = self.reached.as_ref().filter(|_| self.used < TELLING)?;
        let from_laser = reached.by_odometry.between(odometry_pose);
        Some(BySurfaces {
            pose: reached.by_surfaces.compose(&from_laser),
            distance: reached.distance,
            is_torn: reached.is_torn || reached.missed > 0,
            is_led_by_wheels: reached.is_led_by_wheels,
            since: mount.compose(&from_laser),
        })
    }
}

impl Reached {
    fn begin(contours: &mut impl FindContours, laser: &LaserAtStart) -> Self {
        contours.forget_keys();
        contours.keep(&laser.in_world);
        Self {
            by_surfaces: laser.in_world,
            by_odometry: laser.by_odometry,
            distance: 0.0,
            missed: 0,
            is_torn: false,
            is_led_by_wheels: false,
        }
    }

    fn go_on(self, contours: &mut impl FindContours, laser: &LaserAtStart) -> Self {
        let step = self.by_odometry.between(&laser.by_odometry);
        let predicted = Prediction::by_odometry(&self.by_surfaces, &step);
        let found = contours.locate_behind(&predicted).filter(|found| found.share >= LEAST_SHARE);
        let by_surfaces = found.map_or(predicted.pose, |found| found.pose);
        let missed = if found.is_some() { 0 } else { self.missed.saturating_add(1) };
        let is_given_up = missed >= GIVEN_UP;
        if is_given_up {
            contours.forget_keys();
        }
        // What lies on no surface would lie askew among those behind it.
        if missed == 0 || is_given_up {
            contours.keep(&by_surfaces);
        }
        let gone = self.by_surfaces.between(&by_surfaces);
        Self {
            by_surfaces,
            by_odometry: laser.by_odometry,
            distance: self.distance + libm::hypot(gone.x, gone.y),
            missed: if is_given_up { 0 } else { missed },
            is_torn: self.is_torn || is_given_up,
            is_led_by_wheels: self.is_led_by_wheels || found.is_some_and(|found| found.free_axis.is_some()),
        }
    }
}

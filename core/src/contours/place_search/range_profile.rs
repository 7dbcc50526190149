//! How far a scan sees in each direction: what of a map must be hidden, must be seen, or is not there.

use core::f32::consts::TAU;

use crate::contours::SurfacePoint;
use crate::geometry::Transform;
use crate::sensing::PointView;

/// Directions.
const DIRECTIONS: usize = 360;

/// A surface that a scan shows lies within this of its returns, m.
const NEAR: f32 = 0.15;

/// The scan ends so far behind a surface that is not there, m.
const BEHIND: f32 = 0.4;

/// Surfaces between these ranges are looked for, m.
const RANGES: (f32, f32) = (0.5, 15.0);

/// A surface is seen if its normal is within the angle of that cosine of the direction towards the laser.
const FACING: f32 = 0.4;

/// The least and the largest range in each direction, m; nothing was seen where the largest is zero.
#[derive(Clone, Debug)]
pub(super) struct RangeProfile {
    directions: [(f32, f32); DIRECTIONS],
}

/// How many surfaces of a map a scan shows, and how many it has looked through.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct InSight {
    pub shown: u32,
    pub missing: u32,
}

impl InSight {
    /// Share of the surfaces that should be in sight and are; none of none.
    pub(super) fn share(&self) -> f32 {
        self.shown as f32 / (self.shown + self.missing).max(1) as f32
    }
}

impl RangeProfile {
    #[inline(always)]
    pub(super) const fn new() -> Self {
        Self { directions: [(f32::INFINITY, 0.0); DIRECTIONS] }
    }

    /// Takes a scan.
    pub(super) fn set(&mut self, scan: PointView<'_>) {
        self.directions = [(f32::INFINITY, 0.0); DIRECTIONS];
        for (point, range) in scan.points.iter().zip(scan.ranges) {
            if *range > 0.0
                && let Some((least, largest)) = self.directions.get_mut(direction(point.y, point.x))
            {
                let distance = point.norm();
                (*least, *largest) = (least.min(distance), largest.max(distance));
            }
        }
    }

    /// Looks for a surface of the map, which `to_laser` brings into the frame of the scan.
    pub(super) fn look(&self, surface: &SurfacePoint, to_laser: &Transform, found: &mut InSight) {
        let seen = surface.moved(to_laser);
        let range = seen.position.norm();
        if !(RANGES.0..=RANGES.1).contains(&range)
            || (!seen.is_corner() && seen.normal.dot(&seen.position) > -FACING * range)
        {
            return;
        }
        let middle = direction(seen.position.y, seen.position.x);
        let (mut least, mut largest) = (f32::INFINITY, 0.0_f32);
        for direction in [middle + DIRECTIONS - 1, middle, middle + 1] {
            // Where one of them shows nothing, nobody knows how far it sees.
            let Some(&(near, far)) = self.directions.get(direction % DIRECTIONS).filter(|(_, far)| *far > 0.0) else {
                return;
            };
            (least, largest) = (least.min(near), largest.max(far));
        }
        if least > range + BEHIND {
            found.missing += 1;
        } else if least <= range + NEAR && largest >= range - NEAR {
            found.shown += 1;
        }
    }
}

/// The number of a direction.
fn direction(y: f32, x: f32) -> usize {
    let turns = libm::atan2f(y, x) * (1.0 / TAU);
    ((turns - libm::floorf(turns)) * DIRECTIONS as f32) as usize % DIRECTIONS
}

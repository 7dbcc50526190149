//! Which beams of a scan look towards a point.

use core::f32::consts::TAU;

use agv_core::geometry::ScanPoint;
use agv_core::sensing::PointScan;

/// A scan in which beams are looked up by direction.
#[derive(Clone, Copy, Debug)]
pub(super) struct BeamLookup<'a> {
    points: &'a [ScanPoint],
    ranges: &'a [f32],
    first_bearing: f32,
    per_radian: f32,
    is_clockwise: bool,
    is_full_circle: bool,
}

/// A return of the scan.
#[derive(Clone, Copy, Debug)]
pub(super) struct Return {
    /// Position, m.
    pub point: ScanPoint,
    /// Range, m.
    pub range: f32,
}

impl<'a> BeamLookup<'a> {
    pub(super) fn new<const BEAMS: usize>(scan: &'a PointScan<BEAMS>) -> Self {
        Self {
            points: &scan.points,
            ranges: &scan.ranges,
            first_bearing: scan.first_bearing,
            per_radian: 1.0 / scan.bearing_step.max(1e-6),
            is_clockwise: scan.is_clockwise,
            is_full_circle: scan.is_full_circle,
        }
    }

    /// Number of the beam whose direction is nearest to that of `point`; it need not exist.
    pub(super) fn towards(&self, point: &ScanPoint) -> isize {
        let bearing = libm::atan2f(point.y, point.x) - self.first_bearing;
        let turn = if self.is_clockwise { -bearing } else { bearing };
        let turn = if (0.0..TAU).contains(&turn) { turn } else { turn - TAU * libm::floorf(turn / TAU) };
        (turn * self.per_radian + 0.5) as isize
    }

    /// The return of a beam, counted around a full circle. None if there is no such beam, or it has no return.
    pub(super) fn beam(&self, number: isize) -> Option<Return> {
        let count = self.ranges.len() as isize;
        let number = if self.is_full_circle { number.rem_euclid(count.max(1)) } else { number };
        let index = usize::try_from(number).ok()?;
        let range = *self.ranges.get(index)?;
        (range > 0.0).then(|| self.points.get(index).map(|point| Return { point: *point, range })).flatten()
    }
}

//! The points around a candidate (K 3.1.1), organised by beam.

use crate::features::PointScan;
use crate::geometry::ScanPoint;

/// How many beams a neighbourhood reaches to each side at most.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Reach {
    /// Beams before the candidate.
    pub before: usize,
    /// Beams after the candidate.
    pub after: usize,
}

/// A side of a neighbourhood in order of beams, in two pieces if it crosses the seam.
#[derive(Clone, Copy, Debug)]
pub(super) struct Side<'a> {
    first: Piece<'a>,
    second: Piece<'a>,
}

#[derive(Clone, Copy, Debug)]
struct Piece<'a> {
    points: &'a [ScanPoint],
    ranges: &'a [f32],
}

impl<'a> Piece<'a> {
    fn of<const BEAMS: usize>(scan: &'a PointScan<BEAMS>, start: usize, end: usize) -> Self {
        Self {
            points: scan.points.get(start..end).unwrap_or_default(),
            ranges: scan.ranges.get(start..end).unwrap_or_default(),
        }
    }

    #[inline]
    fn returns(self) -> impl DoubleEndedIterator<Item = (ScanPoint, f32)> + ExactSizeIterator {
        self.points.iter().copied().zip(self.ranges.iter().copied())
    }
}

impl<'a> Side<'a> {
    /// The `reach` beams before beam `index`.
    #[inline]
    pub(super) fn before<const BEAMS: usize>(scan: &'a PointScan<BEAMS>, index: usize, reach: usize) -> Self {
        let start = index.saturating_sub(reach);
        let over = reach - (index - start);
        let count = scan.ranges.len();
        Self { first: Piece::of(scan, count.saturating_sub(over), count), second: Piece::of(scan, start, index) }
    }

    /// The `reach` beams after beam `index`.
    #[inline]
    pub(super) fn after<const BEAMS: usize>(scan: &'a PointScan<BEAMS>, index: usize, reach: usize) -> Self {
        let count = scan.ranges.len();
        let end = (index + 1 + reach).min(count);
        let over = (index + 1 + reach) - end;
        Self { first: Piece::of(scan, index + 1, end), second: Piece::of(scan, 0, over) }
    }

    fn len(&self) -> usize {
        self.first.points.len() + self.second.points.len()
    }

    /// Calls `visit` with each present return within the radius of `centre`, relative to it, in order of beams.
    #[inline]
    pub(super) fn visit_near(&self, centre: ScanPoint, squared_radius: f32, mut visit: impl FnMut(ScanPoint)) {
        for piece in [self.first, self.second] {
            for (point, range) in piece.returns() {
                let relative = point - centre;
                if range > 0.0 && relative.norm_squared() <= squared_radius {
                    visit(relative);
                }
            }
        }
    }

    /// The farthest return in order of beams within the radius, for a side that lies before its candidate: beams to
    /// the candidate, and position relative to it.
    #[inline]
    pub(super) fn farthest_before(&self, centre: ScanPoint, squared_radius: f32) -> Option<(usize, ScanPoint)> {
        let length = self.len();
        let near = |(point, range): (ScanPoint, f32)| within(point - centre, range, squared_radius);
        for (skipped, found) in self.first.returns().map(near).enumerate() {
            if let Some(relative) = found {
                return Some((length - skipped, relative));
            }
        }
        let passed = self.first.points.len();
        for (skipped, found) in self.second.returns().map(near).enumerate() {
            if let Some(relative) = found {
                return Some((length - passed - skipped, relative));
            }
        }
        None
    }

    /// The same for a side that lies after its candidate.
    #[inline]
    pub(super) fn farthest_after(&self, centre: ScanPoint, squared_radius: f32) -> Option<(usize, ScanPoint)> {
        let length = self.len();
        let near = |(point, range): (ScanPoint, f32)| within(point - centre, range, squared_radius);
        for (skipped, found) in self.second.returns().rev().map(near).enumerate() {
            if let Some(relative) = found {
                return Some((length - skipped, relative));
            }
        }
        let passed = self.second.points.len();
        for (skipped, found) in self.first.returns().rev().map(near).enumerate() {
            if let Some(relative) = found {
                return Some((length - passed - skipped, relative));
            }
        }
        None
    }
}

#[inline]
fn within(relative: ScanPoint, range: f32, squared_radius: f32) -> Option<ScanPoint> {
    (range > 0.0 && relative.norm_squared() <= squared_radius).then_some(relative)
}

/// Number of beams whose directions differ by less than asin(`sine`); possibly one more, never one less.
#[inline]
pub(super) fn beams_within(sine: f32, bearing_step: f32) -> usize {
    // x + x^3 / 4 is never below asin(x) for x up to 0.8, and close to it for the small x of most neighbourhoods.
    let angle = sine * (1.0 + 0.25 * sine * sine);
    (angle / bearing_step) as usize + 1
}

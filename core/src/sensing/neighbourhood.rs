//! The points around a candidate (K 3.1.1), organised by beam.

use super::PointScan;
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

    /// Calls `visit` with each return inside the disc, relative to its centre, in order of beams.
    #[inline]
    pub(super) fn visit(&self, disc: &Disc, mut visit: impl FnMut(ScanPoint)) {
        for piece in [self.first, self.second] {
            for (point, range) in piece.returns() {
                if let Some(relative) = disc.contains(point, range) {
                    visit(relative);
                }
            }
        }
    }

    /// The first return inside the disc in order of beams, for a side that lies before the centre: beams to the
    /// centre, and position relative to it.
    #[inline]
    pub(super) fn farthest_before(&self, disc: &Disc) -> Option<(usize, ScanPoint)> {
        let mut steps = self.len();
        for piece in [self.first, self.second] {
            for (point, range) in piece.returns() {
                if let Some(relative) = disc.contains(point, range) {
                    return Some((steps, relative));
                }
                steps -= 1;
            }
        }
        None
    }

    /// The last return inside the disc, for a side that lies after the centre.
    #[inline]
    pub(super) fn farthest_after(&self, disc: &Disc) -> Option<(usize, ScanPoint)> {
        let mut steps = self.len();
        for piece in [self.second, self.first] {
            for (point, range) in piece.returns().rev() {
                if let Some(relative) = disc.contains(point, range) {
                    return Some((steps, relative));
                }
                steps -= 1;
            }
        }
        None
    }
}

/// The disc around a candidate that its neighbours lie in.
#[derive(Clone, Copy, Debug)]
pub(super) struct Disc {
    pub centre: ScanPoint,
    /// Range of the centre, m.
    pub range: f32,
    /// Radius, m; less than the range, so that absent returns are never inside.
    pub radius: f32,
}

impl Disc {
    /// Position of a return relative to the centre. None if it is not inside.
    #[inline]
    fn contains(&self, point: ScanPoint, range: f32) -> Option<ScanPoint> {
        let relative = point - self.centre;
        (relative.norm_squared() <= self.radius * self.radius && range > 0.0).then_some(relative)
    }
}

/// Number of beams to each side that may meet a disc whose radius is `sine` of its centre's range: those whose directions
/// differ by less than asin(`sine`), or all of half a turn if the sensor is in the disc. Possibly a few more, never one less.
#[inline]
pub(super) fn beams_within(sine: f32, bearing_step: f32) -> usize {
    let angle = if sine <= 0.8 {
        // Never below asin(x), and close to it for the small x of most neighbourhoods.
        sine * (1.0 + 0.25 * sine * sine)
    } else if sine < 1.0 {
        libm::asinf(sine)
    } else {
        core::f32::consts::PI
    };
    // As many as there are numbers, if beams hardly differ.
    ((angle / bearing_step) as usize).saturating_add(1)
}

/// Calls `visit` with each return within `radius` (m, at most 0.8 of the range) of the return of beam `index`, relative to it,
/// in order of beams; the return itself is left out.
pub fn visit_around<const BEAMS: usize>(
    scan: &PointScan<BEAMS>,
    index: usize,
    radius: f32,
    mut visit: impl FnMut(ScanPoint),
) {
    let (Some(&centre), Some(&range)) = (scan.points.get(index), scan.ranges.get(index)) else { return };
    if range <= 0.0 {
        return;
    }
    let count = scan.ranges.len();
    let most = if scan.is_full_circle { ((count - 1) / 2, (count - 1) / 2) } else { (index, count - 1 - index) };
    let disc = Disc { centre, range, radius: radius.min(0.8 * range) };
    let window = beams_within(disc.radius / range, scan.bearing_step);
    Side::before(scan, index, window.min(most.0)).visit(&disc, &mut visit);
    Side::after(scan, index, window.min(most.1)).visit(&disc, &mut visit);
}

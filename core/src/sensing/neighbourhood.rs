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

/// Neighbouring beams: as many ranges as points.
#[derive(Clone, Copy, Debug, Default)]
struct Piece<'a> {
    points: &'a [ScanPoint],
    ranges: &'a [f32],
}

impl<'a> Piece<'a> {
    #[inline(always)]
    fn of<const BEAMS: usize>(scan: &'a PointScan<BEAMS>, start: usize, end: usize) -> Self {
        match (scan.points.get(start..end), scan.ranges.get(start..end)) {
            (Some(points), Some(ranges)) => Self { points, ranges },
            _ => Self::default(),
        }
    }

    /// Index and relative position of the first return inside the disc.
    #[inline(always)]
    fn first_inside(self, disc: &Disc) -> Option<(usize, ScanPoint)> {
        let mut rest = self.points.iter();
        loop {
            let relative = rest.find_map(|point| disc.holds(point))?;
            // Counted only where it ends: most points at the rim are outside.
            let index = self.points.len() - rest.len() - 1;
            if self.ranges.get(index).is_some_and(|range| *range > 0.0) {
                return Some((index, relative));
            }
        }
    }

    /// Index and relative position of the last return inside the disc.
    #[inline(always)]
    fn last_inside(self, disc: &Disc) -> Option<(usize, ScanPoint)> {
        let mut rest = self.points.iter();
        loop {
            let relative = rest.by_ref().rev().find_map(|point| disc.holds(point))?;
            let index = rest.len();
            if self.ranges.get(index).is_some_and(|range| *range > 0.0) {
                return Some((index, relative));
            }
        }
    }
}

/// What lies beyond the seam concerns few candidates; in the caller it would only slow the others down.
#[cold]
#[inline(never)]
fn first_beyond_seam(piece: Piece<'_>, disc: &Disc) -> Option<(usize, ScanPoint)> {
    piece.first_inside(disc)
}

/// The same after the candidate.
#[cold]
#[inline(never)]
fn last_beyond_seam(piece: Piece<'_>, disc: &Disc) -> Option<(usize, ScanPoint)> {
    piece.last_inside(disc)
}

impl<'a> Side<'a> {
    /// The `reach` beams before beam `index`.
    #[inline(always)]
    pub(super) fn before<const BEAMS: usize>(scan: &'a PointScan<BEAMS>, index: usize, reach: usize) -> Self {
        let Some(start) = index.checked_sub(reach) else {
            let count = scan.ranges.len();
            let first = Piece::of(scan, (count + index).saturating_sub(reach), count);
            return Self { first, second: Piece::of(scan, 0, index) };
        };
        Self { first: Piece::default(), second: Piece::of(scan, start, index) }
    }

    /// The `reach` beams after beam `index`.
    #[inline(always)]
    pub(super) fn after<const BEAMS: usize>(scan: &'a PointScan<BEAMS>, index: usize, reach: usize) -> Self {
        let count = scan.ranges.len();
        let end = index + 1 + reach;
        if end > count {
            return Self { first: Piece::of(scan, index + 1, count), second: Piece::of(scan, 0, end - count) };
        }
        Self { first: Piece::of(scan, index + 1, end), second: Piece::default() }
    }

    /// Calls `visit` with each return inside the disc, relative to its centre, in order of beams.
    // What a caller adds up stays in registers only if the loop is part of the caller.
    #[inline(always)]
    pub(super) fn visit(&self, disc: &Disc, mut visit: impl FnMut(ScanPoint)) {
        for piece in [self.first, self.second] {
            for (point, range) in piece.points.iter().zip(piece.ranges) {
                if let Some(relative) = disc.holds(point)
                    && *range > 0.0
                {
                    visit(relative);
                }
            }
        }
    }

    /// The first return inside the disc in order of beams, for a side that lies before the centre: beams to the
    /// centre, and position relative to it.
    #[inline(always)]
    pub(super) fn farthest_before(&self, disc: &Disc) -> Option<(usize, ScanPoint)> {
        let nearer = self.second.points.len();
        if !self.first.points.is_empty()
            && let Some((index, relative)) = first_beyond_seam(self.first, disc)
        {
            return Some((self.first.points.len() - index + nearer, relative));
        }
        self.second.first_inside(disc).map(|(index, relative)| (nearer - index, relative))
    }

    /// The last return inside the disc, for a side that lies after the centre.
    #[inline(always)]
    pub(super) fn farthest_after(&self, disc: &Disc) -> Option<(usize, ScanPoint)> {
        if !self.second.points.is_empty()
            && let Some((index, relative)) = last_beyond_seam(self.second, disc)
        {
            return Some((self.first.points.len() + index + 1, relative));
        }
        self.first.last_inside(disc).map(|(index, relative)| (index + 1, relative))
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
    /// Position of a point relative to the centre. None if it is not inside.
    #[inline(always)]
    fn holds(&self, point: &ScanPoint) -> Option<ScanPoint> {
        let relative = point - self.centre;
        (relative.norm_squared() <= self.radius * self.radius).then_some(relative)
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

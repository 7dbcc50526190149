//! The points around a candidate (K 3.1.1), organised by beam.

#[cfg(not(target_os = "none"))]
use wide::{CmpLe, f32x8};

use super::{PointScan, PointView};
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
    fn of(scan: &PointView<'a>, start: usize, end: usize) -> Self {
        match (scan.points.get(start..end), scan.ranges.get(start..end)) {
            (Some(points), Some(ranges)) => Self { points, ranges },
            _ => Self::default(),
        }
    }

    /// Relative positions of the returns inside the disc, with their indices.
    #[inline(always)]
    fn inside(self, disc: &Disc) -> impl DoubleEndedIterator<Item = (usize, ScanPoint)> {
        let returns = self.points.iter().zip(self.ranges).enumerate().filter(|(_, (_, range))| **range > 0.0);
        returns.filter_map(|(index, (point, _))| disc.holds(point).map(|relative| (index, relative)))
    }
}

impl<'a> Side<'a> {
    /// The `reach` beams before beam `index`.
    #[inline(always)]
    pub(super) fn before(scan: &PointView<'a>, index: usize, reach: usize) -> Self {
        match index.checked_sub(reach) {
            Some(start) => Self { first: Piece::of(scan, start, index), second: Piece::default() },
            None => {
                let count = scan.ranges.len();
                let first = Piece::of(scan, (count + index).saturating_sub(reach), count);
                Self { first, second: Piece::of(scan, 0, index) }
            }
        }
    }

    /// The `reach` beams after beam `index`.
    #[inline(always)]
    pub(super) fn after(scan: &PointView<'a>, index: usize, reach: usize) -> Self {
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
        let (mut piece, mut next) = (self.first, Some(self.second));
        // At most two pieces.
        loop {
            for (point, range) in piece.points.iter().zip(piece.ranges) {
                if let Some(relative) = disc.holds(point)
                    && *range > 0.0
                {
                    visit(relative);
                }
            }
            let Some(second) = next.take() else { break };
            piece = second;
        }
    }

    /// The first return inside the disc in order of beams, for a side that lies before the centre: beams to the
    /// centre, and position relative to it.
    fn farthest_before(&self, disc: &Disc) -> Option<(usize, ScanPoint)> {
        let (first, second) = (self.first.points.len(), self.second.points.len());
        let in_first = self.first.inside(disc).next().map(|(index, relative)| (first - index + second, relative));
        in_first.or_else(|| self.second.inside(disc).next().map(|(index, relative)| (second - index, relative)))
    }

    /// The last return inside the disc, for a side that lies after the centre.
    fn farthest_after(&self, disc: &Disc) -> Option<(usize, ScanPoint)> {
        let first = self.first.points.len();
        let in_second = self.second.inside(disc).next_back().map(|(index, relative)| (first + index + 1, relative));
        in_second.or_else(|| self.first.inside(disc).next_back().map(|(index, relative)| (index + 1, relative)))
    }
}

/// The first and the last return inside a disc, in order of beams, up to so many before and after the centre: beams to the centre,
/// and position relative to it. None unless there is one on each side.
#[inline(always)]
pub(super) fn farthest(
    scan: &PointView<'_>,
    index: usize,
    (before, after): (u16, u16),
    disc: &Disc,
) -> Option<[(usize, ScanPoint); 2]> {
    let (before, after) = (usize::from(before), usize::from(after));
    if !disc.holds_sensor()
        && let Some(start) = index.checked_sub(before)
        && let Some(points) = scan.points.get(start..index + 1 + after)
    {
        // The centre itself is inside: the ways from both ends to it end there at the latest.
        let first = disc.first(points)?;
        let last = disc.last(points)?;
        let sides = (first < before && last > before).then_some((before - first, last - before))?;
        Some([(sides.0, points.get(first)? - disc.centre), (sides.1, points.get(last)? - disc.centre)])
    } else {
        farthest_of_any(scan, index, (before, after), disc)
    }
}

/// The same across the seam, and where absent returns may be inside. It concerns few; in the caller it would slow the others down.
#[cold]
#[inline(never)]
fn farthest_of_any(
    scan: &PointView<'_>,
    index: usize,
    (before, after): (usize, usize),
    disc: &Disc,
) -> Option<[(usize, ScanPoint); 2]> {
    let before = Side::before(scan, index, before).farthest_before(disc)?;
    let after = Side::after(scan, index, after).farthest_after(disc)?;
    Some([before, after])
}

/// Points that are compared with a disc at once. Where a processor does one at a time, more are wasted effort.
const BLOCK: usize = if cfg!(target_os = "none") { 1 } else { 8 };

/// The disc around a candidate that its neighbours lie in.
#[derive(Clone, Copy, Debug)]
pub(super) struct Disc {
    pub centre: ScanPoint,
    /// Range of the centre, m.
    pub range: f32,
    /// Radius, m; less than the range.
    pub radius: f32,
}

impl Disc {
    /// Position of a point relative to the centre. None if it is not inside.
    #[inline(always)]
    fn holds(&self, point: &ScanPoint) -> Option<ScanPoint> {
        let relative = point - self.centre;
        (relative.norm_squared() <= self.radius * self.radius).then_some(relative)
    }

    /// Whether the sensor is inside, where absent returns are. It is only if motion was corrected.
    #[inline(always)]
    fn holds_sensor(&self) -> bool {
        self.centre.norm_squared() <= self.radius * self.radius
    }

    /// Which of some points are inside, a bit each.
    #[cfg(not(target_os = "none"))]
    #[inline(always)]
    fn holds_any(&self, points: &[ScanPoint; BLOCK]) -> u32 {
        let x = f32x8::from(points.map(|point| point.x)) - f32x8::splat(self.centre.x);
        let y = f32x8::from(points.map(|point| point.y)) - f32x8::splat(self.centre.y);
        let inside = (x * x + y * y).cmp_le(f32x8::splat(self.radius * self.radius));
        // One of the lowest bits for each point.
        inside.move_mask() as u32
    }

    /// Which of some points are inside, a bit each.
    #[cfg(target_os = "none")]
    #[inline(always)]
    fn holds_any(&self, points: &[ScanPoint; BLOCK]) -> u32 {
        let [point] = points;
        u32::from(self.holds(point).is_some())
    }

    /// Index of the first point inside.
    #[inline(always)]
    fn first(&self, points: &[ScanPoint]) -> Option<usize> {
        let (blocks, rest) = points.as_chunks::<BLOCK>();
        let mut passed = 0;
        for block in blocks {
            let inside = self.holds_any(block);
            if inside != 0 {
                return Some(passed + inside.trailing_zeros() as usize);
            }
            passed += BLOCK;
        }
        rest.iter().position(|point| self.holds(point).is_some()).map(|index| passed + index)
    }

    /// Index of the last point inside.
    #[inline(always)]
    fn last(&self, points: &[ScanPoint]) -> Option<usize> {
        let (rest, blocks) = points.as_rchunks::<BLOCK>();
        let mut left = points.len();
        for block in blocks.iter().rev() {
            left -= BLOCK;
            let inside = self.holds_any(block);
            if inside != 0 {
                return Some(left + (u32::BITS - 1 - inside.leading_zeros()) as usize);
            }
        }
        rest.iter().rposition(|point| self.holds(point).is_some())
    }
}

/// Number of beams to each side that may meet a disc whose radius is `sine` of its centre's range: those whose directions
/// differ by less than asin(`sine`), or all of half a turn if the sensor is in the disc. Possibly a few more, never one less.
#[inline]
pub(super) fn beams_within(sine: f32, bearing_step: f32) -> u16 {
    let angle = if sine <= 0.8 {
        // Never below asin(x), and close to it for the small x of most neighbourhoods.
        sine * (1.0 + 0.25 * sine * sine)
    } else if sine < 1.0 {
        libm::asinf(sine)
    } else {
        core::f32::consts::PI
    };
    // As many as there are numbers, if beams hardly differ.
    ((angle / bearing_step) as u16).saturating_add(1)
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
    let window = usize::from(beams_within(disc.radius / range, scan.bearing_step));
    let view = scan.view();
    Side::before(&view, index, window.min(most.0)).visit(&disc, &mut visit);
    Side::after(&view, index, window.min(most.1)).visit(&disc, &mut visit);
}

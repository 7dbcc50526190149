//! Cornerness: how well each side of a corner keeps to one direction (K 3.5-3.10).

use heapless::Vec;

use super::Parameters;
use crate::geometry::ScanPoint;

/// Room for the sectors of a polar grid.
const ROOM: usize = Parameters::MOST_SECTORS as usize;

/// A polar grid of equal sectors.
#[derive(Clone, Debug)]
pub struct Sectors {
    /// Directions of the boundaries strictly inside the upper half plane, as cosine and sine; the first `half - 1`.
    boundaries: [ScanPoint; ROOM / 2 - 1],
    half: usize,
    /// Half a sector as cosine and sine if sectors are centred, else no turn.
    shift: ScanPoint,
}

impl Sectors {
    /// A grid of `count` sectors, made even and brought into 2..=[`Parameters::MOST_SECTORS`]. With `centred` the
    /// axis of the grid is the middle of sector 0, else its lower boundary.
    #[must_use]
    pub fn new(count: u8, centred: bool) -> Self {
        let half = usize::from(count.clamp(2, Parameters::MOST_SECTORS) / 2);
        let width = core::f32::consts::PI / half as f32;
        let mut boundaries = [ScanPoint::zeros(); ROOM / 2 - 1];
        for (boundary, index) in boundaries.iter_mut().take(half - 1).zip(1_u8..) {
            let (sine, cosine) = libm::sincosf(width * f32::from(index));
            *boundary = ScanPoint::new(cosine, sine);
        }
        let (sine, cosine) = if centred { libm::sincosf(0.5 * width) } else { (0.0, 1.0) };
        Self { boundaries, half, shift: ScanPoint::new(cosine, sine) }
    }

    /// Number of sectors.
    #[must_use]
    pub fn count(&self) -> usize {
        2 * self.half
    }

    /// The direction from which [`Sectors::index`] counts, for a grid whose axis is `axis`; neither needs unit length.
    #[must_use]
    pub fn origin(&self, axis: ScanPoint) -> ScanPoint {
        ScanPoint::new(axis.x * self.shift.x + axis.y * self.shift.y, axis.y * self.shift.x - axis.x * self.shift.y)
    }

    /// Sector of a vector, counted from `origin` counter-clockwise (K 3.5, 3.6, with the angle from `origin` instead of
    /// the sensor's first axis).
    #[must_use]
    #[inline]
    pub fn index(&self, origin: ScanPoint, vector: ScanPoint) -> usize {
        let (vector, base) = self.upper(origin, vector);
        base + self.inner_boundaries().partition_point(|boundary| is_past(*boundary, vector))
    }

    /// The same sector without a search: faster for vectors that jump from sector to sector, where a search is guessed
    /// wrong, and slower for vectors in order of direction.
    #[must_use]
    #[inline]
    pub fn index_by_counting(&self, origin: ScanPoint, vector: ScanPoint) -> usize {
        let (vector, base) = self.upper(origin, vector);
        base + self.inner_boundaries().iter().map(|boundary| usize::from(is_past(*boundary, vector))).sum::<usize>()
    }

    fn inner_boundaries(&self) -> &[ScanPoint] {
        self.boundaries.get(..self.half - 1).unwrap_or_default()
    }

    /// A vector in the frame of the origin, folded into the upper half plane, and the first sector of its own half.
    #[inline]
    fn upper(&self, origin: ScanPoint, vector: ScanPoint) -> (ScanPoint, usize) {
        let x = origin.x * vector.x + origin.y * vector.y;
        let y = origin.x * vector.y - origin.y * vector.x;
        let is_lower = y < 0.0 || (y == 0.0 && x < 0.0);
        if is_lower { (ScanPoint::new(-x, -y), self.half) } else { (ScanPoint::new(x, y), 0) }
    }
}

/// Whether a vector of the upper half plane lies on a boundary or beyond it, counter-clockwise.
#[inline]
fn is_past(boundary: ScanPoint, vector: ScanPoint) -> bool {
    boundary.x * vector.y >= boundary.y * vector.x
}

/// How many points of one side lie in each sector.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct SectorCounts([u32; ROOM]);

impl SectorCounts {
    pub(super) fn add(&mut self, sector: usize) {
        if let Some(count) = self.0.get_mut(sector) {
            *count += 1;
        }
    }

    pub(super) fn pair_sum(&self, sectors: usize) -> u32 {
        pair_sum(self.0.get(..sectors).unwrap_or(&self.0))
    }
}

/// Sum of the distances (K 3.7) between the sectors of all pairs of points of one side (K 3.8 or 3.9), given how many
/// points lie in each sector.
///
/// The printed double sum runs over points; points of one sector are alike, so the sum over pairs of sectors is the
/// same integer.
#[must_use]
pub fn pair_sum(counts: &[u32]) -> u32 {
    let mut occupied = Vec::<(usize, u32), ROOM>::new();
    // No grid has more sectors than there is room for.
    occupied.extend(counts.iter().copied().enumerate().filter(|(_, count)| *count > 0).take(ROOM));
    let mut rest = occupied.as_slice();
    let mut sum = 0_u32;
    while let Some(((first, count), others)) = rest.split_first() {
        for (second, other) in others {
            let apart = second - first;
            sum += count * other * apart.min(counts.len() - apart) as u32;
        }
        rest = others;
    }
    sum
}

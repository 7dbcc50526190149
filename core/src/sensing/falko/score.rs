//! Cornerness: how well each side of a corner keeps to one direction (K 3.5-3.10).

use super::Parameters;
use crate::geometry::ScanPoint;

/// Room for the sectors of a polar grid.
const ROOM: usize = Parameters::MOST_SECTORS as usize;

/// Lines that are compared with a vector at once.
const LANES: usize = 4;

/// A polar grid of equal sectors.
#[derive(Clone, Debug)]
pub struct Sectors {
    /// Directions of the boundaries in the upper half plane, of which each goes on as one in the lower half plane; the first
    /// `half`, of which the first is the axis of the grid.
    lines: [Lines; ROOM / 2 / LANES],
    half: usize,
    /// How many blocks of lines there are.
    blocks: usize,
    /// Half a sector as cosine and sine if sectors are centred, else no turn.
    shift: ScanPoint,
}

/// Directions as cosines and sines.
#[derive(Clone, Copy, Debug)]
struct Lines {
    x: [f32; LANES],
    y: [f32; LANES],
}

impl Sectors {
    /// A grid of `count` sectors, made even and brought into 2..=[`Parameters::MOST_SECTORS`]. With `centred` the
    /// axis of the grid is the middle of sector 0, else its lower boundary.
    #[must_use]
    pub fn new(count: u8, centred: bool) -> Self {
        let half = usize::from(count.clamp(2, Parameters::MOST_SECTORS) / 2);
        let width = core::f32::consts::PI / half as f32;
        let mut lines = [Lines::NONE; ROOM / 2 / LANES];
        let directions = lines.iter_mut().flat_map(|lines| lines.x.iter_mut().zip(&mut lines.y));
        for ((x, y), index) in directions.take(half).zip(0_u8..) {
            (*y, *x) = libm::sincosf(width * f32::from(index));
        }
        let (sine, cosine) = if centred { libm::sincosf(0.5 * width) } else { (0.0, 1.0) };
        Self { lines, half, blocks: half.div_ceil(LANES), shift: ScanPoint::new(cosine, sine) }
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
        let (vector, is_lower) = upper(origin, vector);
        let mut passed = [0; LANES];
        for lines in self.lines() {
            lines.count_passed(vector, false, &mut passed);
        }
        // All have passed the axis.
        let inner = passed.iter().sum::<u32>().saturating_sub(1) as usize;
        if is_lower { self.half + inner } else { inner }
    }

    #[inline]
    fn lines(&self) -> impl Iterator<Item = &Lines> {
        self.lines.iter().take(self.blocks)
    }
}

impl Lines {
    /// No lines: no vector passes them.
    const NONE: Self = Self { x: [f32::NAN; LANES], y: [f32::NAN; LANES] };

    /// Adds one to the count of each line on which a vector of the upper half plane lies or which it has passed,
    /// counter-clockwise; or of each that it has not, if so wanted.
    #[inline]
    fn count_passed(&self, vector: ScanPoint, is_inverse: bool, counts: &mut [u32; LANES]) {
        for ((x, y), count) in self.x.iter().zip(&self.y).zip(counts) {
            let is_past = x * vector.y >= y * vector.x;
            // No scan has that many beams.
            *count = count.wrapping_add(u32::from(is_past != is_inverse));
        }
    }
}

/// A vector in the frame of the origin, folded into the upper half plane, and whether it was in the lower one.
#[inline]
fn upper(origin: ScanPoint, vector: ScanPoint) -> (ScanPoint, bool) {
    let x = origin.x * vector.x + origin.y * vector.y;
    let y = origin.x * vector.y - origin.y * vector.x;
    // Without a branch: vectors of one side may lie in both halves.
    let is_lower = (y < 0.0) | ((y == 0.0) & (x < 0.0));
    let sign = if is_lower { -1.0 } else { 1.0 };
    (ScanPoint::new(sign * x, sign * y), is_lower)
}

/// Sum of the distances (K 3.7) between the sectors of all pairs of vectors, those of one side of a corner (K 3.8 or 3.9).
///
/// The distance of two sectors around the circle is the number of the grid's lines that part them. So the sum over pairs is a
/// sum over lines: how many vectors lie on one side times how many lie on the other.
#[derive(Clone, Debug)]
pub struct PairSum<'a> {
    sectors: &'a Sectors,
    origin: ScanPoint,
    count: u32,
    on_left: [[u32; LANES]; ROOM / 2 / LANES],
}

impl<'a> PairSum<'a> {
    /// No vectors, in sectors counted from `origin`.
    #[must_use]
    #[inline]
    pub fn new(sectors: &'a Sectors, origin: ScanPoint) -> Self {
        Self { sectors, origin, count: 0, on_left: [[0; LANES]; ROOM / 2 / LANES] }
    }

    /// Adds a vector.
    #[inline(always)]
    pub fn add(&mut self, vector: ScanPoint) {
        let (vector, is_lower) = upper(self.origin, vector);
        self.count += 1;
        for (lines, on_left) in self.sectors.lines().zip(&mut self.on_left) {
            lines.count_passed(vector, is_lower, on_left);
        }
    }

    /// The sum.
    #[must_use]
    #[inline]
    pub fn value(&self) -> u32 {
        let lines = self.on_left.as_flattened().iter().take(self.sectors.half);
        lines.map(|on_left| on_left * (self.count - on_left)).sum()
    }
}

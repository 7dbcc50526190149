//! A signature of a set of points: how its pairs are directed and how long they are (GLARE, and GLAROT's way to compare,
//! K 4.1.1).

use agv_core::geometry::ScanPoint;

/// Directions of a pair, n_theta.
const DIRECTIONS: usize = 8;

/// Lengths of a pair, n_rho.
const LENGTHS: usize = 64;

const CELLS: usize = DIRECTIONS * LENGTHS;

/// Cells to each side over which a pair is spread.
const REACH: isize = 2;

/// Positions within a cell for which the spread is tabulated.
const PHASES: usize = 8;

/// How pairs are counted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GlareParameters {
    /// Size of a cell of lengths, m; longer pairs than all cells together are not counted.
    pub length_step: f32,
    /// Standard deviation of a pair's length, m.
    pub length_deviation: f32,
    /// Standard deviation of a pair's direction, rad.
    pub direction_deviation: f32,
}

impl Default for GlareParameters {
    fn default() -> Self {
        Self { length_step: 0.25, length_deviation: 0.1, direction_deviation: 0.2 }
    }
}

/// The Gaussians with which a pair is spread over cells, tabulated.
#[derive(Clone, Debug)]
pub struct GlareTables {
    per_metre: f32,
    lengths: [[f32; 2 * REACH as usize + 1]; PHASES],
    directions: [[f32; 2 * REACH as usize + 1]; PHASES],
}

impl GlareTables {
    /// Tables for these parameters.
    #[must_use]
    pub fn new(parameters: &GlareParameters) -> Self {
        let direction_step = core::f32::consts::PI / DIRECTIONS as f32;
        Self {
            per_metre: 1.0 / parameters.length_step,
            lengths: spread(parameters.length_deviation / parameters.length_step),
            directions: spread(parameters.direction_deviation / direction_step),
        }
    }
}

/// Weights of the cells around a value, by where in its cell the value lies; those of one value sum to one.
fn spread(deviation: f32) -> [[f32; 2 * REACH as usize + 1]; PHASES] {
    let mut table = [[0.0; 2 * REACH as usize + 1]; PHASES];
    for (phase, weights) in (0_u8..).zip(&mut table) {
        let position = (f32::from(phase) + 0.5) / PHASES as f32 - 0.5;
        for (cell, weight) in (-(REACH as i8)..).zip(weights.iter_mut()) {
            let share = (f32::from(cell) - position) / deviation.max(1e-3);
            let value = libm::expf(-0.5 * share * share);
            // Far cells cost more than they say.
            *weight = if value < 0.02 { 0.0 } else { value };
        }
        let sum: f32 = weights.iter().sum();
        for weight in weights.iter_mut() {
            *weight = if sum > 0.0 { *weight / sum } else { 0.0 };
        }
    }
    table
}

/// The signature of a set of points, 512 bytes.
///
/// A pair is counted by its length and by its direction modulo half a turn (4.1), so the order of the points does not
/// matter. Turning the points shifts the directions; [`Glare::distance`] tries all shifts by whole cells. The square
/// roots of the sums are kept, in bytes: a large set's sums would drown a small one's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Glare {
    cells: [u8; CELLS],
}

impl Default for Glare {
    fn default() -> Self {
        Self { cells: [0; CELLS] }
    }
}

/// Bytes that one pair in one cell is worth.
const UNIT: f32 = 40.0;

impl Glare {
    /// Angle of one shift, rad.
    pub const DIRECTION_STEP: f32 = core::f32::consts::PI / DIRECTIONS as f32;

    /// The signature of points given by their positions, m.
    #[must_use]
    pub fn of(points: &[ScanPoint], tables: &GlareTables) -> Self {
        let per_radian = 1.0 / Self::DIRECTION_STEP;
        Self::of_pairs(points.len(), tables, |first, second| {
            let between = points.get(second)? - points.get(first)?;
            let direction = libm::atan2f(between.y, between.x);
            let direction = if direction < 0.0 { direction + core::f32::consts::PI } else { direction };
            Some((direction * per_radian, between.norm()))
        })
    }

    /// The signature of points with normals (GSR): a pair is counted by the angle between its normals instead of its
    /// direction, which turning the points does not change. `normals` are rad.
    #[must_use]
    pub fn of_normals(points: &[ScanPoint], normals: &[f32], tables: &GlareTables) -> Self {
        let per_radian = DIRECTIONS as f32 / core::f32::consts::PI;
        Self::of_pairs(points.len().min(normals.len()), tables, |first, second| {
            let between = points.get(second)? - points.get(first)?;
            let turn = libm::fabsf(normals.get(second)? - normals.get(first)?);
            let turn = turn % core::f32::consts::TAU;
            // Of a pair, which point is the first one must not matter.
            let turn = turn.min(core::f32::consts::TAU - turn);
            Some((turn * per_radian * (1.0 - 1e-6), between.norm()))
        })
    }

    /// Counts all pairs of `count` points; `relate` gives the direction, in cells, and the length, m, of a pair.
    fn of_pairs(count: usize, tables: &GlareTables, relate: impl Fn(usize, usize) -> Option<(f32, f32)>) -> Self {
        let mut sums = [0.0_f32; CELLS];
        for second in 1..count {
            for first in 0..second {
                let Some((direction, length)) = relate(first, second) else { continue };
                let length = length * tables.per_metre;
                if length.is_nan() || length >= LENGTHS as f32 || direction.is_nan() || direction < 0.0 {
                    continue;
                }
                let (row, row_phase) = split(direction);
                let (column, column_phase) = split(length);
                let (Some(rows), Some(columns)) = (tables.directions.get(row_phase), tables.lengths.get(column_phase))
                else {
                    continue;
                };
                for (offset, row_weight) in (-REACH..).zip(rows).filter(|(_, weight)| **weight > 0.0) {
                    // The kernel wraps in direction.
                    let row = (row as isize + offset).rem_euclid(DIRECTIONS as isize) as usize;
                    let start = column as isize - REACH;
                    let skipped = (-start).max(0);
                    let begin = row * LENGTHS + (start + skipped) as usize;
                    let end = row * LENGTHS + LENGTHS;
                    let cells = sums.get_mut(begin..end).unwrap_or_default();
                    for (cell, weight) in cells.iter_mut().zip(columns.iter().skip(skipped as usize)) {
                        *cell += row_weight * weight;
                    }
                }
            }
        }
        let mut cells = [0; CELLS];
        for (cell, sum) in cells.iter_mut().zip(&sums) {
            // A conversion to an integer saturates.
            *cell = (UNIT * libm::sqrtf(*sum) + 0.5) as u8;
        }
        Self { cells }
    }

    /// Smallest L1 distance over all shifts of direction (4.2, both indices wrapping), and the shift of `self` that
    /// gives it, in steps of [`Glare::DIRECTION_STEP`].
    #[must_use]
    pub fn distance(&self, other: &Self) -> (u32, u8) {
        ShiftedGlare::new(self).distance(other)
    }

    /// L1 distance without a shift.
    #[must_use]
    pub fn unshifted_distance(&self, other: &Self) -> u32 {
        absolute_difference(&self.cells, &other.cells)
    }
}

/// Index and phase of a cell that a value, in cells, lies in.
fn split(value: f32) -> (usize, usize) {
    let index = value as usize;
    (index, ((value - index as f32) * PHASES as f32) as usize)
}

fn absolute_difference(first: &[u8; CELLS], second: &[u8; CELLS]) -> u32 {
    first.iter().zip(second).map(|(a, b)| u32::from(a.abs_diff(*b))).sum()
}

/// A signature written down twice in a row, so that each shift of it is a contiguous piece.
#[derive(Clone, Debug)]
pub(super) struct ShiftedGlare {
    cells: [u8; 2 * CELLS],
}

impl ShiftedGlare {
    pub(super) fn new(glare: &Glare) -> Self {
        let mut cells = [0; 2 * CELLS];
        for (cell, value) in cells.iter_mut().zip(glare.cells.iter().cycle()) {
            *cell = *value;
        }
        Self { cells }
    }

    /// Smallest distance and its shift.
    pub(super) fn distance(&self, other: &Glare) -> (u32, u8) {
        let mut best = (u32::MAX, 0);
        for shift in 0..DIRECTIONS as u8 {
            let start = usize::from(shift) * LENGTHS;
            let Some(cells) = self.cells.get(start..).and_then(|rest| rest.first_chunk::<CELLS>()) else { continue };
            let distance = absolute_difference(cells, &other.cells);
            if distance < best.0 {
                best = (distance, shift);
            }
        }
        best
    }
}

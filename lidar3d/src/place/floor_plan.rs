//! How near to each cell of the floor plan something stands.

use std::sync::OnceLock;
use std::vec;
use std::vec::Vec;

use super::arctangent::sector;
use super::panorama::COLUMNS;
use super::pose::Pose;

/// Edge of a cell, m, and how many there are along an edge of the plan.
pub(super) const CELL: f32 = 0.25;
const CELLS: usize = 512;
/// Parts of an edge of a cell that tell where in it a point lies.
const PARTS: usize = 4;
/// Greatest reach of a blur, cells.
const WIDEST: usize = 4;
/// Value where a point stands.
const FULL: f32 = 255.0;

/// Points in directions that the place does not know do not count, but for so many of all: a pose that leaves fewer fits by chance.
const FEWEST: f32 = 0.4;

/// Cells around the place of a sensor, which is in the middle.
pub(super) struct FloorPlan {
    values: Vec<u8>,
    /// One where the sensor has looked into the direction of the cell; empty if it is so for all.
    known: Vec<u8>,
}

/// Cells of points in a plan, parted; each once.
pub(super) fn occupied(points: &[[f32; 3]]) -> Vec<u32> {
    let parts = |x: f32| {
        let at = (x / CELL + CELLS as f32 / 2.0) * PARTS as f32;
        (0.0..(CELLS * PARTS) as f32).contains(&at).then_some(at as u32)
    };
    let key = |[x, y, _]: &[f32; 3]| Some(parts(*y)? * (CELLS * PARTS) as u32 + parts(*x)?);
    let mut keys: Vec<u32> = points.iter().filter_map(key).collect();
    keys.sort_unstable();
    keys.dedup();
    keys
}

impl FloorPlan {
    /// Of what [`occupied`] has found, with that standard deviation, m: at most 0.45; of a sensor that knows these directions.
    pub(super) fn new(occupied: &[u32], blur: f32, knows: &[bool; COLUMNS]) -> Self {
        let mut values = vec![0_u8; CELLS * CELLS];
        let reach = ((2.0 * blur / CELL + 1.0) as usize).min(WIDEST);
        let kernels = kernels(blur, reach);
        for key in occupied {
            let [row, column] = [*key as usize / (CELLS * PARTS), *key as usize % (CELLS * PARTS)];
            let (cell, part) = ([row / PARTS, column / PARTS], [row % PARTS, column % PARTS]);
            let first = cell[1].saturating_sub(reach);
            let end = (cell[1] + reach + 1).min(CELLS);
            let (along, across) = (&kernels[part[1]], &kernels[part[0]]);
            for row in cell[0].saturating_sub(reach)..(cell[0] + reach + 1).min(CELLS) {
                let factor = across[row + reach - cell[0]];
                let values = &mut values[row * CELLS + first..row * CELLS + end];
                for (value, share) in values.iter_mut().zip(&along[first + reach - cell[1]..]) {
                    *value = (*value).max((FULL * factor * share) as u8);
                }
            }
        }
        let is_whole = knows.iter().all(|knows| *knows);
        let known = |direction: &u16| u8::from(knows.get(usize::from(*direction)) == Some(&true));
        let known = if is_whole { Vec::new() } else { directions().iter().map(known).collect() };
        Self { values, known }
    }

    /// How well points fit at a pose, 0 to 1.
    pub(super) fn fit(&self, points: &[[f32; 3]], pose: &Pose) -> f32 {
        let (sin, cos) = libm::sincosf(pose.heading);
        let (mut sum, mut known) = (0_u32, 0_u32);
        for [x, y, _] in points {
            let at = |x: f32, y: f32| Some(cell(y)? * CELLS + cell(x)?);
            let cell = at(x * cos - y * sin + pose.place[0], x * sin + y * cos + pose.place[1]);
            sum += cell.and_then(|cell| self.values.get(cell)).map_or(0, |value| u32::from(*value));
            known += cell.and_then(|cell| self.known.get(cell)).map_or(1, |known| u32::from(*known));
        }
        share(sum, known, points.len())
    }

    /// The best of places up to `steps` times `stride` cells away in each direction, at a heading: steps along x and y, and the fit,
    /// best first. Each fits better than those next to it, so at most `count` really different ones are told.
    pub(super) fn best_steps(
        &self,
        points: &[[f32; 3]],
        heading: f32,
        steps: usize,
        stride: usize,
        count: usize,
    ) -> Vec<([i32; 2], f32)> {
        let width = 2 * steps + 1;
        let (sin, cos) = libm::sincosf(heading);
        // The cell of the first step; a point outside may step in.
        let first = |x: f32| libm::floorf(x / CELL + CELLS as f32 / 2.0) as isize - (steps * stride).cast_signed();
        let cells: Vec<[isize; 2]> =
            points.iter().map(|[x, y, _]| [first(x * cos - y * sin), first(x * sin + y * cos)]).collect();
        let mut sums = vec![0_u32; width * width];
        add_steps(&self.values, 0, &cells, stride, width, &mut sums);
        let mut known = vec![points.len() as u32; width * width];
        if !self.known.is_empty() {
            known.fill(0);
            add_steps(&self.known, 1, &cells, stride, width, &mut known);
        }
        let fits: Vec<f32> = sums.iter().zip(&known).map(|(sum, known)| share(*sum, *known, points.len())).collect();
        let step = |at: usize| at as i32 - steps as i32;
        let peaks = (0..fits.len()).filter(|at| is_peak(&fits, width, *at));
        let mut best: Vec<([i32; 2], f32)> = peaks.map(|at| ([step(at % width), step(at / width)], fits[at])).collect();
        best.sort_by(|a, b| b.1.total_cmp(&a.1));
        best.truncate(count);
        best
    }
}

/// Whether a step fits better than all next to it; of equal ones the first counts.
fn is_peak(fits: &[f32], width: usize, at: usize) -> bool {
    let (row, column) = (at / width, at % width);
    let rows = row.saturating_sub(1)..=(row + 1).min(width - 1);
    let columns = column.saturating_sub(1)..=(column + 1).min(width - 1);
    let next = rows.flat_map(|row| columns.clone().map(move |column| row * width + column));
    next.filter(|other| *other != at)
        .all(|other| if other < at { fits[other] < fits[at] } else { fits[other] <= fits[at] })
}

/// Mean value of the points in known directions, 0 to 1.
fn share(sum: u32, known: u32, points: usize) -> f32 {
    sum as f32 / (FULL * (known as f32).max(FEWEST * points as f32).max(1.0))
}

/// Adds to each step the values of the cells that points step into; cells outside have the value `outside`.
fn add_steps(values: &[u8], outside: u32, cells: &[[isize; 2]], stride: usize, width: usize, sums: &mut [u32]) {
    for [column, row] in cells {
        for (j, sums) in sums.chunks_exact_mut(width).enumerate() {
            let row = moved(*row, j * stride).and_then(|row| values.get(row * CELLS..(row + 1) * CELLS));
            let values = row.unwrap_or_default();
            if let Ok(column) = usize::try_from(*column)
                && let Some(values) = values.get(column..=column + (width - 1) * stride)
            {
                for (sum, value) in sums.iter_mut().zip(values.iter().step_by(stride)) {
                    *sum += u32::from(*value);
                }
            } else {
                for (i, sum) in sums.iter_mut().enumerate() {
                    let value = moved(*column, i * stride).and_then(|column| values.get(column));
                    *sum += value.map_or(outside, |value| u32::from(*value));
                }
            }
        }
    }
}

/// In which of the directions of a panorama each cell lies.
fn directions() -> &'static [u16] {
    static OF_CELLS: OnceLock<Vec<u16>> = OnceLock::new();
    let middle = |at: usize| at as f32 + 0.5 - CELLS as f32 / 2.0;
    let direction = |at: usize| sector(middle(at / CELLS), middle(at % CELLS), COLUMNS) as u16;
    OF_CELLS.get_or_init(|| (0..CELLS * CELLS).map(direction).collect())
}

/// A cell so many cells on; None outside of the plan.
fn moved(cell: isize, by: usize) -> Option<usize> {
    usize::try_from(cell + by.cast_signed()).ok().filter(|cell| *cell < CELLS)
}

fn cell(x: f32) -> Option<usize> {
    let at = x / CELL + CELLS as f32 / 2.0;
    (0.0..CELLS as f32).contains(&at).then_some(at as usize)
}

/// For a point in each part of a cell, the shares of the cells beside it.
fn kernels(blur: f32, reach: usize) -> [[f32; 2 * WIDEST + 1]; PARTS] {
    core::array::from_fn(|part| {
        let point = (part as f32 + 0.5) / PARTS as f32;
        core::array::from_fn(|cell| {
            let off = (cell as f32 - reach as f32 + 0.5 - point) * CELL;
            libm::expf(-0.5 * off * off / (blur * blur))
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The value is that of a Gauss at the cell's middle, to the part of a cell.
    #[test]
    fn a_point_is_blurred_and_found() {
        let point = [3.3, -7.1, 1.0];
        let plan = FloorPlan::new(&occupied(&[point]), 0.45, &[true; COLUMNS]);
        for off in [[0.0_f32, 0.0], [0.5, 0.0], [0.25, -0.5], [-0.5, 0.75]] {
            let pose = Pose { place: off, heading: 0.0 };
            let expected = (-0.5 * (off[0] * off[0] + off[1] * off[1]) / (0.45 * 0.45)).exp();
            assert!((plan.fit(&[point], &pose) - expected).abs() < 0.25, "{off:?}");
        }
        let far = Pose { place: [2.0, 0.0], heading: 0.0 };
        assert!(plan.fit(&[point], &far) < 1e-6);
    }

    /// Each step is what a fit at its pose gives, at the edge of the plan as in its middle.
    #[test]
    fn the_best_step_is_the_best_of_all_fits() {
        for middle in [[5.0, -4.0], [63.5, 1.0], [-63.5, 63.0], [30.0, -63.9]] {
            let points: Vec<[f32; 3]> = (0..60)
                .map(|number| {
                    let turn = number as f32;
                    [middle[0] + 3.0 * turn.cos() * (0.3 * turn).sin(), middle[1] + 3.0 * turn.sin(), 1.0]
                })
                .collect();
            let plan = FloorPlan::new(&occupied(&points), 0.45, &[true; COLUMNS]);
            let moved: Vec<[f32; 3]> = points.iter().map(|[x, y, up]| [x - 1.5, y + 0.75, *up]).collect();
            let told = plan.best_steps(&moved, 0.0, 4, 3, 2);
            let (step, fit) = told[0];
            let mut best = (0.0_f32, [0, 0]);
            for (i, j) in (-4..=4).flat_map(|j| (-4..=4).map(move |i| (i, j))) {
                let pose = Pose { place: [0.75 * i as f32, 0.75 * j as f32], heading: 0.0 };
                let fit = plan.fit(&moved, &pose);
                if fit > best.0 {
                    best = (fit, [i, j]);
                }
            }
            assert_eq!(best.1, [2, -1], "{middle:?}");
            assert_eq!(step, best.1, "{middle:?}");
            assert!((fit - best.0).abs() < 1e-6, "{middle:?}: {fit} {}", best.0);
            // The second is elsewhere, and no better.
            if let Some(([x, y], second)) = told.get(1) {
                assert!((x - step[0]).abs().max((y - step[1]).abs()) > 1 && *second <= fit, "{middle:?}: {told:?}");
            }
        }
    }
}

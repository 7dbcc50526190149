//! How much of two scans agrees where one lies on the other.
//!
//! Each point is looked at from where the other scan was made: it is there, or something behind it is seen through it, or it is
//! hidden; in directions that the other scan does not know it does not count. Cells of the floor plan vote, not points: walls have most points, but machines and shelves tell places apart.

use std::vec;

use super::panorama::{COLUMNS, Panorama};

/// Points beyond this do not vote, m.
const REACH: f32 = 70.0;
/// Edge of a cell that votes, m, and how many there are along an edge of the plan.
const CELL: f32 = 0.5;
const CELLS: usize = (2.0 * REACH / CELL) as usize;
/// A point is there if its range is right to this, m, and this part of the range.
const TOLERANCE: [f32; 2] = [0.12, 0.008];
/// Directions that must see farther before a point is seen through.
const THROUGH: usize = 3;

/// What the points of a cell are: there, seen through, hidden.
#[derive(Clone, Copy, Default)]
struct Cell {
    there: u16,
    through: u16,
    hidden: u16,
}

/// Part of the cells of the floor plan that agree, 0 to 1. Of each point: where it is for the panorama, and where it is for the plan.
pub(super) fn agreement(panorama: &Panorama, points: impl Iterator<Item = ([f32; 3], [f32; 3])>) -> f32 {
    let knows = panorama.known_directions();
    let mut cells = vec![Cell::default(); CELLS * CELLS];
    for (seen, [x, y, _]) in points {
        let at = |x: f32| ((x + REACH) / CELL) as usize;
        let Some(cell) = cells.get_mut(at(y) * CELLS + at(x)).filter(|_| at(x) < CELLS) else { continue };
        let count = match verdict(panorama, &knows, seen) {
            Some(Verdict::There) => &mut cell.there,
            Some(Verdict::Through) => &mut cell.through,
            Some(Verdict::Hidden) => &mut cell.hidden,
            None => continue,
        };
        *count = count.saturating_add(1);
    }
    let (mut agreed, mut all) = (0.0, 0.0);
    for Cell { there, through, hidden } in cells {
        let [there, through, hidden] = [there, through, hidden].map(f32::from);
        let count = there + through + hidden;
        if count > 0.0 {
            // Shares of the points, of the weight of the root of their number.
            let weight = 1.0 / libm::sqrtf(count);
            agreed += weight * there;
            all += weight * (there + through + 0.5 * hidden);
        }
    }
    if all > 0.0 { agreed / all } else { 0.0 }
}

/// How a point is seen.
enum Verdict {
    There,
    Through,
    Hidden,
}

/// How a point is seen; None if nobody has looked into its direction, which a mast or a load hides.
fn verdict(panorama: &Panorama, knows: &[bool; COLUMNS], point: [f32; 3]) -> Option<Verdict> {
    let (column, level) = panorama.column(point);
    if knows.get(column * COLUMNS / panorama.columns()) != Some(&true) {
        return None;
    }
    let Some((row, range)) = panorama.row(point, level) else { return Some(Verdict::Hidden) };
    let tolerance = TOLERANCE[0] + TOLERANCE[1] * range;
    let (mut looked, mut farther) = (0, 0);
    for i in 0..3 {
        for j in 0..3 {
            let Some(row) = (row + i).checked_sub(1) else { continue };
            let Some(seen) = panorama.range(row, column + panorama.columns() + j - 1) else { continue };
            if libm::fabsf(seen - range) <= tolerance {
                return Some(Verdict::There);
            }
            looked += 1;
            farther += usize::from(seen > range + tolerance);
        }
    }
    Some(if looked >= THROUGH && farther == looked { Verdict::Through } else { Verdict::Hidden })
}

//! How much of two scans agrees where one lies on the other.
//!
//! Each point is looked at from where the other scan was made: it is there, or something behind it is seen through it, or it is
//! hidden; in directions that the other scan does not know it does not count. Cells of the floor plan vote, not points: walls have most points, but machines and shelves tell places apart.

use std::vec;
use std::vec::Vec;

use super::panorama::{COLUMNS, Panorama};
use super::pose::Pose;

/// What stands on the floor votes, m above it.
const STANDING: [f32; 2] = [0.3, 8.0];
/// Farthest points that count, m.
const FARTHEST: f32 = 60.0;
/// Points that vote, at the most.
const VOTERS: usize = 2500;
/// Points beyond this are outside of the plan, m.
const REACH: f32 = 70.0;
/// Edge of a cell that votes, m, and how many there are along an edge of the plan.
const CELL: f32 = 0.5;
const CELLS: usize = (2.0 * REACH / CELL) as usize;
/// A point is there if its range is right to this, m, and this part of the range.
const TOLERANCE: [f32; 2] = [0.12, 0.008];
/// The same of a pose that is known to half a metre and two degrees.
const ROUGHLY: [f32; 2] = [0.5, 0.01];
/// Points that the panorama knows count for so many of all at the least: a pose that leaves fewer agrees by chance.
const FEWEST: f32 = 0.25;
/// What both see counts for so much of all at the least.
const LEAST_SEEN: f32 = 0.1;
/// Weight of a hidden point among those that contradict.
const HIDDEN: f32 = 0.5;
/// Directions that must see farther before a point is seen through.
const THROUGH: usize = 3;

/// What the points of a cell are: there, seen through, hidden.
#[derive(Clone, Copy, Default)]
struct Cell {
    there: u16,
    through: u16,
    hidden: u16,
}

impl Cell {
    fn is_empty(self) -> bool {
        self.there == 0 && self.through == 0 && self.hidden == 0
    }
}

/// How much of two scans agrees, 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Agreement {
    /// Part of the cells of the floor plan that is there for both, one that is hidden counting half: by it poses are compared.
    pub score: f32,
    /// Part of what both see that is the same: what is hidden from one of them says neither.
    pub visible: f32,
}

impl Agreement {
    /// None of none.
    pub(super) fn mean(all: impl Iterator<Item = Self>) -> Self {
        let (mut sum, mut count) = (Self { score: 0.0, visible: 0.0 }, 0.0_f32);
        for one in all {
            sum = Self { score: sum.score + one.score, visible: sum.visible + one.visible };
            count += 1.0;
        }
        let share = 1.0 / count.max(1.0);
        Self { score: sum.score * share, visible: sum.visible * share }
    }
}

/// A scan, as it agrees with others: what it has seen, and the points that vote.
pub(super) struct Voters<'a> {
    pub panorama: &'a Panorama,
    pub knows: [bool; COLUMNS],
    points: Vec<[f32; 3]>,
}

impl<'a> Voters<'a> {
    /// Of a panorama, and points that stand on the floor.
    pub fn new(panorama: &'a Panorama, standing: &[[f32; 3]]) -> Self {
        Self { panorama, knows: panorama.known_directions(), points: thinned(standing, VOTERS) }
    }

    /// Of a panorama and its own points.
    pub fn of(panorama: &'a Panorama) -> Self {
        let points: Vec<[f32; 3]> = panorama.points().filter(is_standing).collect();
        Self::new(panorama, &points)
    }

    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// Part of the points of another scan that agree where it lies roughly at a pose in this one, 0 to 1.
    pub fn rough_agreement(&self, points: &[[f32; 3]], pose: &Pose) -> f32 {
        let out = pose.out();
        let (mut agreed, mut all) = (0.0_f32, 0.0_f32);
        for point in points {
            match verdict(self.panorama, &self.knows, out(*point), ROUGHLY) {
                Some(Verdict::There) => (agreed, all) = (agreed + 1.0, all + 1.0),
                Some(Verdict::Through) => all += 1.0,
                Some(Verdict::Hidden) => all += HIDDEN,
                None => {}
            }
        }
        agreed / all.max(FEWEST * points.len() as f32).max(1.0)
    }

    /// How much agrees where another scan lies at a pose in this one: the mean of both ways.
    pub fn agreement(&self, other: &Self, pose: &Pose) -> Agreement {
        let (out, back) = (pose.out(), pose.back());
        let there = other.points.iter().map(|point| out(*point));
        let here = self.points.iter().map(|point| (back(*point), *point));
        let from_here = agreement(self.panorama, &self.knows, there.map(|point| (point, point)));
        let from_there = agreement(other.panorama, &other.knows, here);
        Agreement::mean([from_here, from_there].into_iter())
    }
}

/// Whether a point stands on the floor, near enough to count.
pub(super) fn is_standing([x, y, up]: &[f32; 3]) -> bool {
    (STANDING[0]..STANDING[1]).contains(up) && x * x + y * y < FARTHEST * FARTHEST
}

/// Every so many points that there are at most `count`.
pub(super) fn thinned(points: &[[f32; 3]], count: usize) -> Vec<[f32; 3]> {
    points.iter().step_by(points.len().div_ceil(count).max(1)).copied().collect()
}

/// How much of the cells of the floor plan agrees where the panorama knows these directions. Of each point: where it is for the
/// panorama, and where it is for the plan.
fn agreement(
    panorama: &Panorama,
    knows: &[bool; COLUMNS],
    points: impl Iterator<Item = ([f32; 3], [f32; 3])>,
) -> Agreement {
    let mut cells = vec![Cell::default(); CELLS * CELLS];
    let mut voting = Vec::new();
    for (seen, [x, y, _]) in points {
        let at = |x: f32| ((x + REACH) / CELL) as usize;
        let number = at(y) * CELLS + at(x);
        let Some(cell) = cells.get_mut(number).filter(|_| at(x) < CELLS) else { continue };
        let is_first = cell.is_empty();
        let count = match verdict(panorama, knows, seen, TOLERANCE) {
            Some(Verdict::There) => &mut cell.there,
            Some(Verdict::Through) => &mut cell.through,
            Some(Verdict::Hidden) => &mut cell.hidden,
            None => continue,
        };
        *count = count.saturating_add(1);
        if is_first {
            voting.push(number);
        }
    }
    let (mut agreed, mut seen, mut all) = (0.0_f32, 0.0_f32, 0.0_f32);
    for Cell { there, through, hidden } in voting.into_iter().filter_map(|number| cells.get(number).copied()) {
        let [there, through, hidden] = [there, through, hidden].map(f32::from);
        // Shares of the points, of the weight of the root of their number.
        let weight = 1.0 / libm::sqrtf(there + through + hidden);
        agreed += weight * there;
        seen += weight * (there + through);
        all += weight * (there + through + hidden);
    }
    let share = |of: f32| if of > 0.0 { agreed / of } else { 0.0 };
    Agreement { score: share(seen + HIDDEN * (all - seen)), visible: share(seen.max(LEAST_SEEN * all)) }
}

/// How a point is seen.
enum Verdict {
    There,
    Through,
    Hidden,
}

/// How a point is seen; None if nobody has looked into its direction, which a mast or a load hides.
fn verdict(panorama: &Panorama, knows: &[bool; COLUMNS], point: [f32; 3], tolerance: [f32; 2]) -> Option<Verdict> {
    let (column, level) = panorama.column(point);
    if knows.get(column * COLUMNS / panorama.columns()) != Some(&true) {
        return None;
    }
    let Some((row, range)) = panorama.row(point, level) else { return Some(Verdict::Hidden) };
    let tolerance = tolerance[0] + tolerance[1] * range;
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

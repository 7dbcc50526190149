//! A scan aligned to a stored place, and how much of it agrees.
//!
//! The floor plan of what stands on the floor is laid over that of the stored panorama, coarsely at many starts, then finer.
//! Where the scan lies then, each of its points is looked at from the stored place, and each stored one from where the scan
//! was made: it is there, or something behind it is seen through it, or it is hidden. Cells of the floor plan vote, not
//! points: walls have most points, but machines and shelves tell places apart.

use std::vec;
use std::vec::Vec;

use super::panorama::Panorama;

/// What stands on the floor, m above it.
const STANDING: [f32; 2] = [0.3, 8.0];
/// Farthest points that count, m.
const REACH: f32 = 60.0;
/// Cells of the plan, m, and how many there are along an edge.
const CELL: f32 = 0.25;
const CELLS: usize = 512;
/// Deviations of the plan that is searched coarsely and finely, m.
const BLUR: [f32; 2] = [0.45, 0.2];
/// Points that are laid over the plan, coarsely and finely.
const POINTS: [usize; 2] = [300, 900];
/// Coarse starts: turns to both sides of a heading, rad, and steps to the sides, m.
const TURNS: [f32; 5] = [-0.0698, -0.0349, 0.0, 0.0349, 0.0698];
const STEP: f32 = 0.75;
/// Starts that go on.
const STARTS: usize = 4;
/// Steps of the climb: m and rad, and how often they are halved.
const CLIMB: [f32; 2] = [0.4, 0.0175];
const HALVINGS: usize = 5;
/// Points that vote, at the most.
const VOTERS: usize = 2500;
/// Edge of a cell that votes, m.
const VOTE_CELL: f32 = 0.5;
/// A point is there if its range is right to this, m, and this part of the range.
const TOLERANCE: [f32; 2] = [0.12, 0.008];
/// Directions that must see farther before a point is seen through.
const THROUGH: usize = 3;

/// Where a scan lies in a stored place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// x, y, m.
    pub place: [f32; 2],
    /// Counter-clockwise, rad.
    pub heading: f32,
}

impl Pose {
    pub(super) fn of(&self, [x, y, up]: [f32; 3]) -> [f32; 3] {
        let (sin, cos) = libm::sincosf(self.heading);
        [x * cos - y * sin + self.place[0], x * sin + y * cos + self.place[1], up]
    }

    fn back(&self, [x, y, up]: [f32; 3]) -> [f32; 3] {
        let (sin, cos) = libm::sincosf(self.heading);
        let (x, y) = (x - self.place[0], y - self.place[1]);
        [x * cos + y * sin, y * cos - x * sin, up]
    }
}

/// What an alignment found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Alignment {
    /// Where the asked scan lies in the stored place.
    pub pose: Pose,
    /// Part of the cells of the floor plan that agree, 0 to 1.
    pub score: f32,
}

/// How near to each cell of the floor plan something stands, 0 to 1, at a blur.
struct Plan(Vec<f32>);

impl Plan {
    fn new(points: &[[f32; 3]], blur: f32) -> Self {
        let mut plan = vec![0.0_f32; CELLS * CELLS];
        let reach = (2.0 * blur / CELL + 1.0) as isize;
        for [x, y, _] in points {
            let (Some(column), Some(row)) = (cell(*x), cell(*y)) else { continue };
            for (i, j) in (-reach..=reach).flat_map(|i| (-reach..=reach).map(move |j| (i, j))) {
                let at = (column as isize + i, row as isize + j);
                let Some(value) = place(at).and_then(|place| plan.get_mut(place)) else { continue };
                // From the point itself to the middle of the cell.
                let off = |at: isize, x: f32| (at as f32 + 0.5 - CELLS as f32 / 2.0) * CELL - x;
                let squared = off(at.0, *x).powi(2) + off(at.1, *y).powi(2);
                *value = value.max(libm::expf(-0.5 * squared / (blur * blur)));
            }
        }
        Self(plan)
    }

    /// How well points fit at a pose, 0 to 1.
    fn fit(&self, points: &[[f32; 3]], pose: &Pose) -> f32 {
        let (sin, cos) = libm::sincosf(pose.heading);
        let at = |[x, y, _]: &[f32; 3]| {
            let (column, row) = (cell(x * cos - y * sin + pose.place[0])?, cell(x * sin + y * cos + pose.place[1])?);
            self.0.get(row * CELLS + column).copied()
        };
        points.iter().filter_map(at).sum::<f32>() / points.len().max(1) as f32
    }
}

fn cell(x: f32) -> Option<usize> {
    let at = x / CELL + CELLS as f32 / 2.0;
    (0.0..CELLS as f32).contains(&at).then_some(at as usize)
}

fn place((column, row): (isize, isize)) -> Option<usize> {
    let range = 0..CELLS as isize;
    (range.contains(&column) && range.contains(&row)).then_some(row as usize * CELLS + column as usize)
}

/// A stored place, ready for alignments.
pub struct Stored<'a> {
    panorama: &'a Panorama,
    plans: [Plan; 2],
    points: Vec<[f32; 3]>,
}

/// A scan that is asked for: its panorama, and its points with their heights above the floor, m.
pub struct Asked<'a> {
    panorama: &'a Panorama,
    standing: Vec<[f32; 3]>,
}

impl<'a> Asked<'a> {
    /// Of levelled points.
    #[must_use]
    pub fn new(panorama: &'a Panorama, points: impl Iterator<Item = [f32; 3]>) -> Self {
        Self { panorama, standing: points.filter(is_standing).collect() }
    }
}

fn is_standing([x, y, up]: &[f32; 3]) -> bool {
    (STANDING[0]..STANDING[1]).contains(up) && x * x + y * y < REACH * REACH
}

/// Every so many points that there are at most `count`.
fn thinned(points: &[[f32; 3]], count: usize) -> Vec<[f32; 3]> {
    points.iter().step_by(points.len().div_ceil(count).max(1)).copied().collect()
}

impl<'a> Stored<'a> {
    /// Of its panorama.
    #[must_use]
    pub fn new(panorama: &'a Panorama) -> Self {
        let points: Vec<[f32; 3]> = panorama.points().filter(is_standing).collect();
        let plans = BLUR.map(|blur| Plan::new(&points, blur));
        Self { panorama, plans, points }
    }

    /// Aligns a scan that is turned about as one of some headings, rad, counter-clockwise, and at most `reach` away in each
    /// direction, m. None if nothing stands about either.
    #[must_use]
    pub fn align(&self, asked: &Asked<'_>, headings: &[f32], reach: f32) -> Option<Alignment> {
        if asked.standing.is_empty() || self.points.is_empty() {
            return None;
        }
        let few = thinned(&asked.standing, POINTS[0]);
        let steps = (reach / STEP) as i32;
        let mut starts: Vec<(f32, Pose)> = Vec::new();
        for heading in headings.iter().flat_map(|heading| TURNS.map(|turn| heading + turn)) {
            let mut best = (0.0, Pose { place: [0.0; 2], heading });
            for (i, j) in (-steps..=steps).flat_map(|i| (-steps..=steps).map(move |j| (i, j))) {
                let pose = Pose { place: [STEP * i as f32, STEP * j as f32], heading };
                let fit = self.plans[0].fit(&few, &pose);
                if fit > best.0 {
                    best = (fit, pose);
                }
            }
            starts.push(best);
        }
        starts.sort_by(|a, b| b.0.total_cmp(&a.0));
        let many = thinned(&asked.standing, POINTS[1]);
        let climbed = starts.iter().take(STARTS).map(|(_, pose)| {
            let coarse = climb(&self.plans[0], &few, *pose);
            let pose = climb(&self.plans[1], &many, coarse);
            (self.plans[1].fit(&many, &pose), pose)
        });
        let (_, pose) = climbed.max_by(|a, b| a.0.total_cmp(&b.0))?;
        Some(Alignment { pose, score: self.score(asked, &pose) })
    }

    /// Part of the cells that agree, the mean of both ways.
    fn score(&self, asked: &Asked<'_>, pose: &Pose) -> f32 {
        let there = thinned(&asked.standing, VOTERS);
        let there = there.iter().map(|point| pose.of(*point));
        let here = thinned(&self.points, VOTERS);
        let here = here.iter().map(|point| (pose.back(*point), *point));
        let from_stored = voted(self.panorama, there.map(|point| (point, point)));
        let from_asked = voted(asked.panorama, here);
        0.5 * (from_stored + from_asked)
    }
}

/// Steps to a neighbour as long as it fits better, ever smaller.
fn climb(plan: &Plan, points: &[[f32; 3]], start: Pose) -> Pose {
    let mut best = (plan.fit(points, &start), start);
    let [mut step, mut turn] = CLIMB;
    for _ in 0..HALVINGS {
        // Bounded: a climb of more than this many steps is no climb any more.
        for _ in 0..20 {
            let Pose { place: [x, y], heading } = best.1;
            let around = [
                ([x + step, y], heading),
                ([x - step, y], heading),
                ([x, y + step], heading),
                ([x, y - step], heading),
                ([x, y], heading + turn),
                ([x, y], heading - turn),
            ];
            let neighbours = around.map(|(place, heading)| {
                let pose = Pose { place, heading };
                (plan.fit(points, &pose), pose)
            });
            match neighbours.into_iter().max_by(|a, b| a.0.total_cmp(&b.0)) {
                Some(better) if better.0 > best.0 => best = better,
                _ => break,
            }
        }
        step /= 2.0;
        turn /= 2.0;
    }
    best.1
}

/// What the points of a cell are: there, seen through, hidden.
#[derive(Clone, Copy, Default)]
struct Cell {
    there: u16,
    through: u16,
    hidden: u16,
}

/// Part of the cells of the floor plan that agree, as a panorama sees points that lie in cells.
fn voted(panorama: &Panorama, points: impl Iterator<Item = ([f32; 3], [f32; 3])>) -> f32 {
    let edge = (2.0 * (REACH + 10.0) / VOTE_CELL) as usize;
    let mut cells = vec![Cell::default(); edge * edge];
    for (seen, [x, y, _]) in points {
        let at = |x: f32| ((x + REACH + 10.0) / VOTE_CELL) as usize;
        let Some(cell) = cells.get_mut(at(y) * edge + at(x)).filter(|_| at(x) < edge) else { continue };
        match verdict(panorama, seen) {
            Some(true) => cell.there += 1,
            Some(false) => cell.through += 1,
            None => cell.hidden += 1,
        }
    }
    let (mut agreed, mut all) = (0.0, 0.0);
    for Cell { there, through, hidden } in cells {
        let count = f32::from(there + through + hidden);
        if count > 0.0 {
            // Shares of the points, of the weight of the root of their number.
            let weight = libm::sqrtf(count) / count;
            agreed += weight * f32::from(there);
            all += weight * (f32::from(there) + f32::from(through) + 0.5 * f32::from(hidden));
        }
    }
    if all > 0.0 { agreed / all } else { 0.0 }
}

/// Whether a point is there, or seen through; None if it is hidden or not looked at.
fn verdict(panorama: &Panorama, point: [f32; 3]) -> Option<bool> {
    let (row, column, range) = panorama.direction(point)?;
    let tolerance = TOLERANCE[0] + TOLERANCE[1] * range;
    let (mut looked, mut farther) = (0, 0);
    for i in 0..3 {
        for j in 0..3 {
            let Some(row) = (row + i).checked_sub(1) else { continue };
            let Some(seen) = panorama.range(row, column + super::panorama::COLUMNS + j - 1) else { continue };
            if libm::fabsf(seen - range) <= tolerance {
                return Some(true);
            }
            looked += 1;
            farther += usize::from(seen > range + tolerance);
        }
    }
    (looked >= THROUGH && farther == looked).then_some(false)
}

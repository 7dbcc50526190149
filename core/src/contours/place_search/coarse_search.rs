//! All places of a map at which a scan may have been taken, roughly: from coarse to fine, by what cannot be excluded.

use core::f64::consts::TAU;

use heapless::Vec;

use super::bit_planes::{MOST_BESIDE, MOST_POINTS};
use super::place_grid::{COARSEST, LEVELS, Offset, PlaceGrid, SMALLEST_CELL, direction, facing};
use crate::contours::SurfacePoint;
use crate::geometry::{Pose, ScanPoint, Transform, difference, wrap};
use crate::order::insertion_sort_by;

/// Points that are looked for.
const SOUGHT: usize = 48;

const _: () = assert!(SOUGHT <= MOST_POINTS, "bit planes count no more");

/// Fewest that say something of a place.
const FEWEST: usize = 12;

/// They are so far apart, m: the least distance at which there are no more of them,
const SPACINGS: [f32; 4] = [0.4, 0.8, 1.6, 3.2];

/// and no further away, m: the error of the heading moves them by less than a cell.
const REACH: f32 = 20.0;

const _: () = assert!(
    REACH as f64 / (SMALLEST_CELL * (1 << COARSEST) as f64) + 1.0 < MOST_BESIDE as f64,
    "bit planes do not reach further beside the map"
);

/// Headings that are tried at the finest scale.
const HEADINGS: u16 = 512;

/// Headings at the finest scale within one at the coarsest.
const FINE: usize = 1 << COARSEST;

/// Share of the points that must be able to lie on surfaces: where there is a good place, to ask for much finds it soon. If that finds too
/// little, all is looked at again,
const LEAST_SHARES: [f32; 2] = [0.85, 0.6];

/// and share of those of the best place.
const AS_GOOD: f32 = 0.87;

/// Places that are kept.
pub(super) const PLACES: usize = 192;

/// Places closer than this are one: cells of the finest scale along each axis, and rad.
const SAME: (f64, f64) = (2.5, 0.12);

/// Points of a scan that follow one another are so many apart.
const STRIDE: usize = 19;

/// What a heading of the coarsest scale costs, in points that are looked up: its offsets.
const HEADING_EFFORT: i64 = 2500;

/// What a point costs that is looked up for a group of cells.
const GROUP_EFFORT: i64 = 2;

/// What a cell costs beside the points that are looked up for it.
const CELL_EFFORT: i64 = 4;

/// A place, and how many of the points may lie on surfaces there.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub pose: Pose,
    pub hits: usize,
}

/// The points of a scan at the headings of one branch: one of the coarsest scale, and those of finer scales within it.
#[derive(Clone, Debug)]
struct Branch {
    headings: [[Vec<Offset, SOUGHT>; FINE]; LEVELS],
}

/// The whole number nearest to one of less than a thousand: a conversion, which cuts off, is one instruction.
fn nearest(number: f32) -> i16 {
    ((number + 1024.5) as i16).wrapping_sub(1024)
}

/// A cell at a scale and a heading, by its number within that of the coarsest scale.
#[derive(Clone, Copy, Debug)]
struct Node {
    level: usize,
    branch: usize,
    column: i32,
    row: i32,
}

/// Nodes that wait: seven of each scale but the coarsest, and one more.
const NODES: usize = 7 * COARSEST + 1;

/// A point that is looked for, and the direction in which its surface faces, rad; none of a corner.
#[derive(Clone, Copy, Debug)]
struct Sought {
    position: ScanPoint,
    direction: Option<f32>,
}

/// Searches a grid.
#[derive(Clone, Debug)]
pub(super) struct CoarseSearch {
    sought: Vec<Sought, SOUGHT>,
    branch: Branch,
    /// The heading of the coarsest scale that is looked at, and its next cells there; none before the points are turned to it.
    heading: u16,
    group: Option<i32>,
    /// Those of the cells before that cannot be excluded and were not looked at, a bit each.
    open: u32,
    /// How often all headings have been looked at.
    pass: usize,
    /// Cells within those before that wait to be looked at.
    nodes: Vec<Node, NODES>,
    places: Vec<Place, PLACES>,
    /// Hits of the best place that was left out.
    left_out: usize,
    /// Fewest points that must be able to lie on surfaces.
    needed: usize,
}

impl CoarseSearch {
    #[inline(always)]
    pub(super) const fn new() -> Self {
        Self {
            sought: Vec::new(),
            branch: Branch { headings: [const { [const { Vec::new() }; FINE] }; LEVELS] },
            heading: 0,
            group: None,
            open: 0,
            pass: 0,
            nodes: Vec::new(),
            places: Vec::new(),
            left_out: 0,
            needed: 0,
        }
    }

    /// Begins with the points of a scan. False if they are too few.
    pub(super) fn begin(&mut self, points: &[SurfacePoint]) -> bool {
        self.sought.clear();
        self.places.clear();
        self.nodes.clear();
        (self.heading, self.group, self.left_out) = (0, None, 0);
        (self.open, self.pass) = (0, 0);
        for spacing in SPACINGS {
            self.sought.clear();
            let is_all = points.iter().filter(|point| point.position.norm() <= REACH).all(|point| {
                let is_near = |other: &Sought| (other.position - point.position).norm_squared() < spacing * spacing;
                let sought = Sought { position: point.position, direction: direction(point) };
                self.sought.iter().any(is_near) || self.sought.push(sought).is_ok()
            });
            if is_all {
                break;
            }
        }
        self.mix();
        self.needed = self.fewest();
        self.sought.len() >= FEWEST
    }

    /// Brings the points into an order in which the first ones are of all directions.
    fn mix(&mut self) {
        let count = self.sought.len();
        let unmixed = self.sought.clone();
        for (place, point) in self.sought.iter_mut().enumerate() {
            // Prime, and no divisor of the count.
            let number = if count.is_multiple_of(STRIDE) { place } else { place * STRIDE % count };
            if let Some(other) = unmixed.get(number) {
                *point = *other;
            }
        }
    }

    /// The places that were found, the best first.
    pub(super) fn places(&self) -> &[Place] {
        &self.places
    }

    /// One of them is known better now.
    pub(super) fn set_pose(&mut self, place: usize, pose: Pose) {
        if let Some(place) = self.places.get_mut(place) {
            place.pose = pose;
        }
    }

    /// Whether a place was left out that is about as good as those that are kept.
    pub(super) fn is_crowded(&self) -> bool {
        self.left_out >= self.needed
    }

    /// Fewest points that must be able to lie on surfaces, by the best place that was found so far.
    fn fewest(&self) -> usize {
        let best = self.places.first().map_or(0, |best| best.hits);
        let least = LEAST_SHARES.get(self.pass).copied().unwrap_or(1.0);
        let share = |share: f32, of: usize| libm::ceilf(share * of as f32) as usize;
        share(least, self.sought.len()).max(share(AS_GOOD, best)).max(1)
    }

    /// Looks at cells, as far as the effort goes: points that are looked up. Whether there is more to do.
    pub(super) fn advance<const CELLS: usize>(&mut self, grid: &PlaceGrid<CELLS>, effort: &mut i64) -> bool {
        let (planes, bytes) = grid.coarsest();
        while self.goes_on() {
            if *effort <= 0 {
                return true;
            }
            if let Some(node) = self.nodes.pop() {
                self.look(grid, node, effort);
                continue;
            }
            let Some(group) = self.group else {
                *effort -= HEADING_EFFORT;
                self.turn(grid.cell());
                self.group = Some(0);
                continue;
            };
            if self.open != 0 {
                let lane = self.open.trailing_zeros() as i32;
                self.open &= self.open - 1;
                // It is the one before.
                if let Some((column, row)) = planes.first_of(group - 1) {
                    self.divide(grid, &Node { level: COARSEST, branch: 0, column: column + lane, row });
                }
            } else if group < planes.groups() {
                let offsets = self.branch.headings.get(COARSEST).and_then(|headings| headings.first());
                let offsets = offsets.map_or(&[][..], |offsets| offsets);
                let (open, looked_up) = planes.fitting(bytes, offsets, group, self.needed);
                *effort -= GROUP_EFFORT * i64::from(looked_up) + CELL_EFFORT;
                (self.open, self.group) = (open, Some(group + 1));
            } else {
                (self.heading, self.group) = (self.heading + 1, None);
            }
        }
        let needed = self.needed;
        self.places.retain(|place| place.hits >= needed);
        false
    }

    /// Whether there are headings to look at: all of them again, if one that was not found may be good enough.
    fn goes_on(&mut self) -> bool {
        if usize::from(self.heading) * FINE < usize::from(HEADINGS) {
            return true;
        }
        if self.pass + 1 >= LEAST_SHARES.len() {
            return false;
        }
        self.pass += 1;
        let was_needed = self.needed;
        self.needed = self.fewest();
        let is_again = self.needed < was_needed;
        if is_again {
            self.heading = 0;
        }
        is_again
    }

    /// Looks at a cell. Those within it wait if it cannot be excluded.
    fn look<const CELLS: usize>(&mut self, grid: &PlaceGrid<CELLS>, node: Node, effort: &mut i64) {
        let Node { level, branch, column, row } = node;
        let Some(offsets) = self.branch.headings.get(level).and_then(|headings| headings.get(branch)) else {
            return;
        };
        let (hits, looked_up) = grid.level(level).hits(offsets, (column, row), self.needed);
        *effort -= i64::from(looked_up) + CELL_EFFORT;
        if hits == 0 {
            return;
        }
        if level > 0 {
            return self.divide(grid, &node);
        }
        let middle = grid.middle(column, row);
        let theta = wrap(self.heading_of(0, branch));
        self.keep(Place { pose: Pose { x: middle.x, y: middle.y, theta }, hits }, grid.cell());
    }

    /// What is within a cell waits: it has two headings and four cells.
    fn divide<const CELLS: usize>(&mut self, grid: &PlaceGrid<CELLS>, node: &Node) {
        let Some(finer) = node.level.checked_sub(1) else { return };
        let within = grid.level(finer);
        for (x, y) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            let (column, row) = (2 * node.column + x, 2 * node.row + y);
            if column < within.columns() && row < within.rows() {
                for branch in [2 * node.branch, 2 * node.branch + 1] {
                    // There is room: one is taken before eight come.
                    let _ = self.nodes.push(Node { level: finer, branch, column, row });
                }
            }
        }
    }

    /// The middle of a heading, rad.
    fn heading_of(&self, level: usize, branch: usize) -> f64 {
        let first = f64::from(self.heading) * FINE as f64;
        let width = f64::from(1 << level);
        (first + (branch as f64 + 0.5) * width) * (TAU / f64::from(HEADINGS))
    }

    /// Turns the points to the headings of a branch.
    fn turn(&mut self, cell: f64) {
        for level in 0..LEVELS {
            let per_metre = (1.0 / (cell * f64::from(1 << level))) as f32;
            for branch in 0..FINE >> level {
                let heading = self.heading_of(level, branch);
                let turned = Transform::of(&Pose { theta: heading, ..Pose::default() });
                let offset = |point: &Sought| {
                    let moved = turned.apply(&point.position);
                    let count = |length: f32| nearest(length * per_metre);
                    // The finest scale does not ask.
                    let turned = point.direction.filter(|_| level > 0).map(|direction| direction + heading as f32);
                    Offset { column: count(moved.x), row: count(moved.y), facing: facing(turned) }
                };
                if let Some(offsets) = self.branch.headings.get_mut(level).and_then(|all| all.get_mut(branch)) {
                    offsets.clear();
                    // Both have the same room.
                    for point in &self.sought {
                        let _ = offsets.push(offset(point));
                    }
                }
            }
        }
    }

    /// Keeps a place among the best distinct ones.
    fn keep(&mut self, place: Place, cell: f64) {
        let is_same = |other: &Place| {
            let reach = SAME.0 * cell;
            libm::fabs(other.pose.x - place.pose.x) < reach
                && libm::fabs(other.pose.y - place.pose.y) < reach
                && libm::fabs(difference(other.pose.theta, place.pose.theta)) < SAME.1
        };
        if let Some(same) = self.places.iter_mut().find(|other| is_same(other)) {
            if place.hits <= same.hits {
                return;
            }
            *same = place;
        } else if self.places.push(place).is_err() {
            let Some(last) = self.places.last_mut() else { return };
            let worse = if place.hits > last.hits { core::mem::replace(last, place) } else { place };
            self.left_out = self.left_out.max(worse.hits);
        }
        insertion_sort_by(&mut self.places, |a, b| b.hits.cmp(&a.hits));
        self.needed = self.fewest();
    }
}

//! The pose, among many around the predicted one, under which most points of a scan lie near surfaces.
//!
//! E. Olson, "Real-time correlative scan matching" (ICRA 2009), with a weight for what the prediction says.

use core::f32::consts::PI;

use heapless::Vec;

use super::likelihood_grid::CELL;
use super::{LikelihoodGrid, SurfacePoint};
use crate::geometry::{Pose, ScanPoint, Transform, wrap};
use crate::order::Evenly;

/// Points that are looked up.
const POINTS: usize = 90;

/// So many even for many poses.
const FEWEST_POINTS: usize = 30;

/// Values that are looked up, where poses are no more than for that number of points.
const LOOK_UPS: usize = 120_000;

/// What is searched around a pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SearchWindow {
    /// Steps to each side along each axis.
    pub shifts: u8,
    /// Length of a step, cells of the grid.
    pub shift: u8,
    /// Turns to each side.
    pub turns: u8,
    /// One turn, rad.
    pub turn: f32,
    /// Distance from the prediction at which a pose has lost a fifth of its weight, m.
    pub distance: f32,
}

impl SearchWindow {
    /// As wrong as the odometry between two scans of a robot usually is: 0.4 m and half a radian.
    pub const USUAL: Self = Self { shifts: 2, shift: 2, turns: 9, turn: 3.0 * PI / 180.0, distance: 0.3 };

    /// Where the usual window holds nothing that fits: 2 m and one radian.
    pub const WIDE: Self = Self { shifts: 5, shift: 4, turns: 10, turn: 6.0 * PI / 180.0, distance: 1.2 };

    /// Number of poses; at least one.
    fn poses(&self) -> usize {
        let sides = |steps: u8| 2 * usize::from(steps) + 1;
        sides(self.shifts) * sides(self.shifts) * sides(self.turns)
    }

    /// Length of a step, m.
    #[must_use]
    pub fn step(&self) -> f32 {
        f32::from(self.shift) * CELL
    }
}

/// Turn from the prediction at which a pose has lost a fifth of its weight, rad.
const HEADING: f32 = 20.0 * PI / 180.0;

/// What was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SearchResult {
    /// The best pose, in the frame of the grid.
    pub pose: Pose,
    /// Share of the looked up values in the largest ones there could be, from 0 to 1.
    pub score: f32,
}

/// Where the points of a scan are in a grid.
struct Cells {
    /// Numbers of cells that stay in the grid however they are shifted.
    inside: Vec<u32, POINTS>,
    /// Columns and rows of those that may come into it or leave it.
    others: Vec<(i32, i32), POINTS>,
}

impl Cells {
    /// Takes points, which will be shifted by at most so many cells along each axis.
    fn set(&mut self, points: &[ScanPoint], transform: &Transform, most: i32) {
        self.inside.clear();
        self.others.clear();
        for point in points {
            let (column, row) = LikelihoodGrid::cell(&transform.apply(point));
            // Both have room for all.
            if let Some(number) = LikelihoodGrid::number_within(column, row, most) {
                let _ = self.inside.push(number);
            } else if LikelihoodGrid::can_enter(column, row, most) {
                let _ = self.others.push((column, row));
            }
        }
    }

    /// Sum of the values under them if they are shifted by so many cells.
    fn sum(&self, grid: &LikelihoodGrid, (columns, rows): (i32, i32)) -> u32 {
        let inside = grid.sum_of(&self.inside, LikelihoodGrid::numbers_between(columns, rows));
        let others = self.others.iter().map(|(column, row)| u32::from(grid.value(column + columns, row + rows)));
        inside + others.sum::<u32>()
    }
}

/// Looks around `predicted`, a pose in the frame of the grid. Without points the prediction is the answer.
#[must_use]
pub fn search(points: &[SurfacePoint], grid: &LikelihoodGrid, predicted: &Pose, window: &SearchWindow) -> SearchResult {
    let room = LOOK_UPS.checked_div(window.poses()).unwrap_or(POINTS).clamp(FEWEST_POINTS, POINTS);
    let mut evenly = Evenly::new(room, points.len());
    let mut chosen: Vec<ScanPoint, POINTS> = Vec::new();
    for point in points.iter().filter(|_| evenly.takes()).take(room) {
        // There is room.
        let _ = chosen.push(point.position);
    }
    let mut cells = Cells { inside: Vec::new(), others: Vec::new() };
    let mut best = SearchResult { pose: *predicted, score: 0.0 };
    let mut best_weighted = 0.0;
    let step = i32::from(window.shift);
    let shifts = -i32::from(window.shifts)..=i32::from(window.shifts);
    let largest = (3 * chosen.len().max(1)) as f32;
    for number in -i32::from(window.turns)..=i32::from(window.turns) {
        let turn = number as f32 * window.turn;
        let by_turn = (1.0 - 0.2 * turn * turn / (HEADING * HEADING)).max(0.8);
        let turned = Pose { theta: wrap(predicted.theta + f64::from(turn)), ..*predicted };
        let transform = Transform::of(&turned);
        cells.set(&chosen, &transform, i32::from(window.shifts) * step);
        for row in shifts.clone() {
            for column in shifts.clone() {
                let sum = cells.sum(grid, (column * step, row * step));
                let (x, y) = ((column * step) as f32 * CELL, (row * step) as f32 * CELL);
                let by_shift = (1.0 - 0.2 * (x * x + y * y) / (window.distance * window.distance)).max(0.5);
                let weighted = sum as f32 * by_turn * by_shift;
                if weighted > best_weighted {
                    best_weighted = weighted;
                    let pose = Pose { x: turned.x + f64::from(x), y: turned.y + f64::from(y), ..turned };
                    best = SearchResult { pose, score: sum as f32 / largest };
                }
            }
        }
    }
    best
}

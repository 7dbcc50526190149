//! How many separate things say where a scan is along an axis, and whether others say otherwise.
//!
//! Where few things stand around, one of them that was moved since the map was made takes the pose along with it, and all that is in sight
//! still agrees. So each thing has a vote for every shift along the axis by which its surfaces come to lie on those of the map.

use crate::contours::kept_map::middle;
use crate::contours::{KeptMap, SurfacePoint, Tile};
use crate::geometry::{Pose, ScanPoint, Transform};

/// Shifts to each side, and the distance between them, m: things are moved by as much as they reach.
const SIDE: usize = 14;
const STEP: f32 = 0.05;
const SHIFTS: usize = 2 * SIDE + 1;

/// A surface votes for the shifts within this, m.
const TOLERANCE: f32 = 0.051;

/// Shifts that are closer to the best one are the same, steps.
const SAME: usize = 3;

/// Cosine of the largest angle between a normal and an axis of which it says something.
const ACROSS: f32 = 0.5;

/// A corner is the same if it is within this across the axis, m.
const BESIDE: f32 = 0.1;

/// Surfaces are of one thing if they are no further apart than this, m,
const GAP: f32 = 0.5;

/// and from the first of them: what is longer is seldom moved.
const LENGTH: f32 = 3.0;

/// Fewest things that must agree.
const FEWEST: u32 = 2;

/// Points of a scan that are taken in one step.
const POINTS_A_STEP: usize = 8;

/// What was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Verdict {
    /// Enough things agree on a shift, m, and few say otherwise.
    Agreed(f32),
    /// Things say otherwise: by so many metres.
    Disputed(f32),
    /// Too few say anything.
    TooFew,
}

/// Votes that are being collected.
#[derive(Clone, Copy, Debug)]
pub(super) struct Support {
    place: (i16, i16),
    /// Of the scan in the middle of the place.
    transform: Transform,
    axis: ScanPoint,
    /// Things that vote for each shift, a bit each.
    votes: [u64; SHIFTS],
    point: usize,
    /// The thing that is being looked at: its number, where it begins and where its last surface was.
    thing: u32,
    ends: Option<(ScanPoint, ScanPoint)>,
}

impl Support {
    /// Begins to ask about an axis at a pose in the map; None if it is beyond all tiles.
    pub(super) fn begin(pose: &Pose, axis: ScanPoint) -> Option<Self> {
        let place = Tile::place_of(pose.x, pose.y)?;
        let transform = Transform::of(&middle(place).between(pose));
        Some(Self { place, transform, axis, votes: [0; SHIFTS], point: 0, thing: 0, ends: None })
    }

    /// Takes some points of a scan; how many of the map were looked at, and whether there is more to do.
    pub(super) fn step(&mut self, points: &[SurfacePoint], map: &KeptMap) -> (u32, bool) {
        let mut looked_at: u32 = 0;
        for point in points.iter().skip(self.point).take(POINTS_A_STEP) {
            looked_at = looked_at.saturating_add(self.ask(point, map));
        }
        self.point += POINTS_A_STEP;
        (looked_at, self.point < points.len())
    }

    fn ask(&mut self, point: &SurfacePoint, map: &KeptMap) -> u32 {
        let moved = point.moved(&self.transform);
        let axis = self.axis;
        if !moved.is_corner() && libm::fabsf(moved.normal.dot(&axis)) < ACROSS {
            return 0;
        }
        let bit = self.thing_of(&moved.position);
        let votes = &mut self.votes;
        map.for_each_near(self.place, &moved.position, SIDE as f32 * STEP, |other| {
            if other.is_like(&moved)
                && let Some(shift) = shift_onto(&moved, &other, axis)
            {
                for (number, things) in votes.iter_mut().enumerate() {
                    if libm::fabsf(shift_of(number) - shift) <= TOLERANCE {
                        *things |= bit;
                    }
                }
            }
        })
    }

    /// The bit of the thing to which a surface belongs that comes next.
    fn thing_of(&mut self, position: &ScanPoint) -> u64 {
        let is_same = |(first, last): &(ScanPoint, ScanPoint)| {
            (position - last).norm() <= GAP && (position - first).norm() <= LENGTH
        };
        let first = match self.ends.filter(is_same) {
            Some((first, _)) => first,
            None => {
                self.thing = if self.ends.is_some() { self.thing + 1 } else { 0 };
                *position
            }
        };
        self.ends = Some((first, *position));
        // The last bit is for all that are too many.
        1 << self.thing.min(u64::BITS - 1)
    }

    /// What was found after the last point.
    pub(super) fn verdict(&self) -> Verdict {
        let nearest_first = |number: &usize| number.abs_diff(SIDE);
        let best = (0..SHIFTS).max_by_key(|number| (self.things(*number, 0), SHIFTS - nearest_first(number)));
        let Some(best) = best else { return Verdict::TooFew };
        let (supporters, agreeing) = (self.votes.get(best).copied().unwrap_or(0), self.things(best, 0));
        let rivals = (0..SHIFTS).filter(|number| number.abs_diff(best) >= SAME);
        let rival = rivals.max_by_key(|number| self.things(*number, supporters));
        let against = rival.map_or(0, |rival| self.things(rival, supporters));
        if agreeing > 2 * against && agreeing >= FEWEST {
            Verdict::Agreed(shift_of(best))
        } else if let Some(rival) = rival.filter(|_| against > 0) {
            Verdict::Disputed(shift_of(rival))
        } else {
            Verdict::TooFew
        }
    }

    /// Number of things that vote for a shift and are not among others.
    fn things(&self, number: usize, others: u64) -> u32 {
        self.votes.get(number).map_or(0, |votes| (votes & !others).count_ones())
    }
}

/// The shift of a number, m.
fn shift_of(number: usize) -> f32 {
    (number as f32 - SIDE as f32) * STEP
}

/// By how much a surface must be shifted along an axis to lie on another one.
fn shift_onto(surface: &SurfacePoint, other: &SurfacePoint, axis: ScanPoint) -> Option<f32> {
    let apart = other.position - surface.position;
    if surface.is_corner() {
        let along = apart.dot(&axis);
        return ((apart - axis * along).norm() <= BESIDE).then_some(along);
    }
    let across = other.normal.dot(&axis);
    (libm::fabsf(across) >= ACROSS).then(|| other.normal.dot(&apart) / across)
}

//! Whether the laser has moved as the odometry says.
//!
//! Landmarks are remembered for a moment in the frame of the odometry. If the vehicle moves as its odometry says, those
//! seen a revolution ago are seen again where they were. If hardly one of them is, and most of what is seen instead is new,
//! the laser has moved otherwise: the vehicle has slid or was carried, its wheel has spun, or the laser was knocked.
//! No map is needed, so that a wrong place that looks right does not hide it.

use heapless::Vec;

use crate::geometry::Point;
use crate::measurement::Time;

/// Landmarks that are remembered.
const REMEMBERED: usize = 32;
/// How long one is remembered that is not seen again, s.
const MEMORY: f64 = 1.0;
/// One that was seen no longer ago than this, s, should be seen again: two revolutions and a little.
const EXPECTED: f64 = 0.3;
/// Landmarks on either side that a verdict needs.
const LEAST: usize = 3;
/// Of those that should be seen again, this share is not enough.
const TOO_FEW: f64 = 0.2;
/// Revolutions in a row that must disagree.
const IN_A_ROW: u8 = 2;
/// How far from its place one may be seen again, m, and by how much more for each metre of its distance.
const GATE: (f64, f64) = (0.05, 0.006);

#[derive(Clone, Copy, Debug)]
struct Remembered {
    position: Point,
    seen: Time,
    times: u8,
}

/// The memory, and how often it was contradicted.
#[derive(Clone, Debug)]
pub struct MotionCheck {
    remembered: Vec<Remembered, REMEMBERED>,
    now: Time,
    expected: usize,
    seen_again: usize,
    seen: usize,
    new: usize,
    contradictions: u8,
}

impl MotionCheck {
    /// A check that has seen nothing.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            remembered: Vec::new(),
            now: Time::from_micros(0),
            expected: 0,
            seen_again: 0,
            seen: 0,
            new: 0,
            contradictions: 0,
        }
    }

    /// Forgets everything.
    pub fn clear(&mut self) {
        self.remembered.clear();
        self.contradictions = 0;
    }

    /// Begins a revolution that ends at `now`.
    pub fn begin(&mut self, now: Time) {
        self.now = now;
        self.remembered.retain(|one| now.since(one.seen) <= MEMORY);
        let is_expected = |one: &&Remembered| one.times >= 2 && now.since(one.seen) <= EXPECTED;
        self.expected = self.remembered.iter().filter(is_expected).count();
        (self.seen_again, self.seen, self.new) = (0, 0, 0);
    }

    /// Takes a landmark of the revolution: where it is in the frame of the odometry, m, and how far from the laser, m.
    pub fn see(&mut self, position: &Point, range: f64) {
        let now = self.now;
        let gate = GATE.0 + GATE.1 * range;
        self.seen += 1;
        let known = self
            .remembered
            .iter_mut()
            .filter(|one| now.since(one.seen) > 0.0)
            .map(|one| ((one.position - position).norm_squared(), one))
            .filter(|(square, _)| *square <= gate * gate)
            .min_by(|(a, _), (b, _)| a.total_cmp(b));
        if let Some((_, one)) = known {
            self.seen_again += usize::from(one.times >= 2 && now.since(one.seen) <= EXPECTED);
            *one = Remembered { position: *position, seen: now, times: one.times.saturating_add(1) };
            return;
        }
        self.new += 1;
        let one = Remembered { position: *position, seen: now, times: 1 };
        if let Err(one) = self.remembered.push(one)
            && let Some(oldest) = self.remembered.iter_mut().min_by_key(|other| other.seen)
        {
            *oldest = one;
        }
    }

    /// Ends the revolution. True if the laser has moved otherwise than the odometry says.
    pub fn disagrees(&mut self) -> bool {
        let can_tell = self.expected >= LEAST && self.seen >= LEAST;
        let is_contradicted =
            can_tell && (self.seen_again as f64) < TOO_FEW * self.expected as f64 && 2 * self.new >= self.seen;
        self.contradictions = if is_contradicted { self.contradictions.saturating_add(1) } else { 0 };
        self.contradictions >= IN_A_ROW
    }
}

impl Default for MotionCheck {
    fn default() -> Self {
        Self::new()
    }
}

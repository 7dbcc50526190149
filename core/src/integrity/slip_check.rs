//! Whether the laser has moved as the odometry says.
//!
//! Landmarks are remembered for a moment in the frame of the odometry. If the vehicle moves as its odometry says, those
//! seen a revolution ago are seen again where they were. If hardly one of them is, and more than half of what is seen is new,
//! the laser has moved otherwise: the vehicle has slid or was carried, its wheel has spun, or the laser was knocked.
//! The same is true if none of them is seen again although the scan shows nothing before their places. Few landmarks may all be hidden at
//! once, as at the end of an aisle, while false ones come: then the scan must show that they are not hidden.
//! No map is needed, so that a wrong place that looks right does not hide it.

use heapless::Vec;
use serde::{Deserialize, Serialize};

use crate::geometry::{Point, Pose, ScanPoint};
use crate::measurement::{Scan, Time};

/// Landmarks that are remembered.
const REMEMBERED: usize = 32;
/// For how many revolutions one is remembered that is not seen again.
const MEMORY: u8 = 8;
/// One that was seen no more revolutions ago should be seen again.
const EXPECTED: u8 = 2;
/// After a longer pause between two revolutions, s, everything is forgotten: the view has changed.
const LONGEST_PAUSE: f64 = 0.3;
/// Landmarks on either side that a verdict needs.
const LEAST: usize = 3;
/// With fewer on either side, or if one is seen again, which speaks against it, the scan must confirm it, if there is one: half of those that
/// are not seen again must be hidden by nothing.
const SURE: u8 = 6;
/// Of those that should be seen again, this share is not enough.
const TOO_FEW: f64 = 0.2;
/// Revolutions in a row that must disagree.
const IN_A_ROW: u8 = 2;
/// How far from its place one may be seen again, m, and by how much more for each metre of its distance.
const GATE: (f64, f64) = (0.05, 0.006);
/// Nothing stands before a landmark if the beams toward it, within this distance, m, and this turn, rad, end no nearer than it by so
/// much, m, at most; landmarks between these ranges are looked for.
const BESIDE: (f64, f64) = (0.2, 0.02);
const BEFORE: f64 = 0.3;
const RANGES: (f64, f64) = (1.0, 15.0);
/// Landmarks that are gone, with none seen again, in one revolution, and in each of two in a row: a laser misses a landmark that it sees
/// well less than once in fifty revolutions, and flat ones may turn out of its sight, two at once on both sides of an aisle.
const GONE: [usize; 2] = [4, 3];
/// Fewer that should be seen again may all turn out of its sight at once, as at the end of an aisle: if the surfaces of the scan have stayed,
/// they tell no move, unless others are seen. Nor do more, if the map has all that are seen instead.
const MANY: u8 = 7;
/// Fewer of which none is seen again are nothing unusual.
const SEVERAL: u8 = 4;

#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Remembered {
    position: ScanPoint,
    /// Revolutions since it was seen.
    age: u8,
    /// In how many revolutions it was seen.
    times: u8,
}

impl Remembered {
    fn is_expected(&self) -> bool {
        self.times >= 2 && self.age <= EXPECTED
    }

    /// Whether it was seen in this revolution, or should be seen again in the next one: were it forgotten for what is new,
    /// many landmarks at once would never contradict.
    fn is_needed(&self) -> bool {
        self.age == 0 || (self.times >= 2 && self.age < EXPECTED)
    }
}

/// The memory, and how often it was contradicted.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct SlipCheck {
    remembered: Vec<Remembered, REMEMBERED>,
    last: Time,
    expected: u8,
    seen_again: u8,
    seen: u8,
    new: u8,
    contradictions: u8,
    /// Revolutions in a row in which landmarks were gone.
    gone: u8,
    /// Whether the scan of the revolution is still to come.
    awaits_scan: bool,
    /// Whether the revolution before had a scan.
    has_scans: bool,
    /// Whether the scan of the revolution must confirm that the laser has moved otherwise.
    is_doubted: bool,
}

impl SlipCheck {
    /// A check that has seen nothing.
    #[must_use]
    pub const fn new() -> Self {
        let last = Time::from_micros(0);
        Self {
            remembered: Vec::new(),
            last,
            expected: 0,
            seen_again: 0,
            seen: 0,
            new: 0,
            contradictions: 0,
            gone: 0,
            awaits_scan: false,
            has_scans: false,
            is_doubted: false,
        }
    }

    /// Forgets everything.
    pub fn clear(&mut self) {
        self.remembered.clear();
        self.contradictions = 0;
        self.gone = 0;
        self.is_doubted = false;
    }

    /// Begins a revolution that ends at `now`.
    pub fn begin(&mut self, now: Time) {
        if now.since(self.last) > LONGEST_PAUSE {
            self.clear();
        }
        self.last = now;
        self.expected = 0;
        for one in &mut self.remembered {
            one.age = one.age.saturating_add(1);
            self.expected += u8::from(one.is_expected());
        }
        self.remembered.retain(|one| one.age <= MEMORY);
        (self.seen_again, self.seen, self.new) = (0, 0, 0);
        // Without a scan nobody knows what hides them.
        self.gone = if self.awaits_scan { 0 } else { self.gone };
        self.has_scans = !self.awaits_scan;
        self.awaits_scan = true;
    }

    /// Takes a landmark of the revolution: where it is in the frame of the odometry, m, and how far from the laser, m.
    pub fn see(&mut self, position: &Point, range: f64) {
        let gate = (GATE.0 + GATE.1 * range) as f32;
        let position: ScanPoint = position.cast();
        self.seen = self.seen.saturating_add(1);
        let mut nearest = gate * gate;
        let mut known = None;
        for one in &mut self.remembered {
            let (x, y) = (one.position.x - position.x, one.position.y - position.y);
            let square = x * x + y * y;
            if square <= nearest && one.age > 0 {
                (nearest, known) = (square, Some(one));
            }
        }
        if let Some(one) = known {
            self.seen_again += u8::from(one.is_expected());
            // What was seen once before may itself be the first that contradicts.
            self.new = self.new.saturating_add(u8::from(one.times < 2));
            *one = Remembered { position, age: 0, times: one.times.saturating_add(1) };
            return;
        }
        self.new = self.new.saturating_add(1);
        let one = Remembered { position, age: 0, times: 1 };
        if self.remembered.is_full() {
            let others = self.remembered.iter_mut().filter(|other| !other.is_needed());
            if let Some(place) = others.max_by_key(|other| other.age) {
                *place = one;
            }
        } else {
            let _ = self.remembered.push(one);
        }
    }

    /// Ends the revolution. True if the laser has moved otherwise than the odometry says, which landmarks alone do not say where there are
    /// scans if they are few, or one of them says otherwise: see [`Self::misses`].
    pub fn disagrees(&mut self) -> bool {
        let can_tell = usize::from(self.expected.min(self.seen)) >= LEAST;
        self.gone = if self.sees_none_again() { self.gone } else { 0 };
        let is_contradicted = can_tell && self.sees_too_few_again() && self.new > self.seen.saturating_sub(self.new);
        self.contradictions = if is_contradicted { self.contradictions.saturating_add(1) } else { 0 };
        let disagrees = self.contradictions >= IN_A_ROW;
        let is_sure = self.expected.min(self.seen) >= SURE && self.seen_again == 0;
        self.is_doubted = disagrees && self.has_scans && !is_sure;
        disagrees && !self.is_doubted
    }

    /// Whether the laser seems to have moved otherwise, and the scan of the revolution must confirm it.
    #[must_use]
    pub const fn is_doubted(&self) -> bool {
        self.is_doubted
    }

    fn sees_too_few_again(&self) -> bool {
        f64::from(self.seen_again) < TOO_FEW * f64::from(self.expected)
    }

    /// Whether hardly any landmark is seen again in the revolution of several that should be.
    #[must_use]
    pub fn has_lost_sight(&self) -> bool {
        self.expected >= SEVERAL && self.sees_too_few_again()
    }

    /// Whether a scan is awaited because no landmark was seen again of those that should be.
    fn sees_none_again(&self) -> bool {
        let [_, fewest] = GONE;
        self.awaits_scan && self.seen_again == 0 && usize::from(self.expected) >= fewest
    }

    /// Takes the scan of the revolution that has ended, whose laser was at `sensor` in the frame of the odometry, whether its surfaces
    /// have stayed where they were, and whether the map has all that the revolution has seen. True if landmarks that should be seen again are
    /// gone, though nothing hides them: none is there, or others are.
    pub fn misses(&mut self, scan: &Scan, sensor: &Pose, have_surfaces_stayed: bool, do_all_fit: bool) -> bool {
        let count = |nearest: f64, farthest: f64| {
            let is_gone = |one: &&Remembered| {
                let place = sensor.inverse_transform(&one.position.cast());
                let is_within = (nearest..=farthest).contains(&libm::hypot(place.x, place.y));
                one.is_expected() && one.age > 0 && is_within && scan.passes(&place, BESIDE, -BEFORE)
            };
            self.remembered.iter().filter(is_gone).count()
        };
        let [at_once, in_a_row] = GONE;
        let gone = if self.sees_none_again() { count(RANGES.0, RANGES.1) } else { 0 };
        let unseen = usize::from(self.expected.saturating_sub(self.seen_again));
        let is_confirmed = self.is_doubted && 2 * count(0.0, f64::INFINITY) >= unseen;
        self.awaits_scan = false;
        self.gone = if gone >= in_a_row { self.gone.saturating_add(1) } else { 0 };
        let may_have_turned = (self.expected < MANY || do_all_fit) && have_surfaces_stayed;
        let are_gone = gone >= at_once || self.gone >= IN_A_ROW;
        is_confirmed || (are_gone && !may_have_turned)
    }
}

impl Default for SlipCheck {
    fn default() -> Self {
        Self::new()
    }
}

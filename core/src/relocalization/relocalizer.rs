//! The search: complete, bounded, and able to pause.
//!
//! An answer must explain at least half of the reflectors seen. Of n reflectors of which k are explained, split into k - 1
//! groups, two explained ones share a group: it suffices to look for the pairs within groups, about n / 2 of them. One
//! pass over all pairs of the map finds what they may be. Every pose that explains k is found so, the best and the
//! runner-up alike, and only a clear gap between the two makes an answer.

use heapless::Vec;

use super::distance_histogram::DistanceHistogram;
use super::groups::Groups;
use super::indexed_reflectors::LARGEST_REACH;
use super::sought_pairs::{SoughtPair, SoughtPairs};
use super::{IndexedReflectors, ReflectorAnswer, ReflectorFix, ReflectorSnapshot, SeenReflector};
use crate::geometry::{Pose, ScanPoint, Transform, difference, fit_rigid};
use crate::maps::Landmark;
use crate::order::insertion_sort_by;

/// When a pose is believed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RelocalizationParameters {
    /// Fewest reflectors that must be explained.
    pub fewest: u8,
    /// By how much the logarithm of the best pose's likelihood must exceed that of the runner-up.
    pub least_gap: f32,
    /// A reflector is explained if the map has one within this many standard deviations.
    pub gate: f32,
    /// How many false reflectors there are a square metre.
    pub false_density: f32,
    /// Poses closer than this are one, m and rad.
    pub same_pose: (f64, f64),
}

impl Default for RelocalizationParameters {
    fn default() -> Self {
        Self { fewest: 4, least_gap: 12.0, gate: 3.5, false_density: 7e-4, same_pose: (0.3, 0.05) }
    }
}

/// Whether a search has ended.
#[expect(clippy::large_enum_variant, reason = "there is no heap, and one such value at a time")]
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RelocalizationProgress {
    /// There is more to look at.
    Searching,
    /// All has been looked at.
    Done(ReflectorAnswer),
}

/// Poses that are kept for the comparison.
const KEPT: usize = 8;

/// A baseline shorter than this, m, says little of the heading, and is looked up last.
const SHORT_BASELINE: f32 = 4.0;

/// Lookups that a short baseline may save to be preferred all the same.
const SHORT_PENALTY: f32 = 40.0;

/// What a hypothesis costs, in looks at a mapped pair.
const HYPOTHESIS: i64 = 16;

/// What a hypothesis costs that enough reflectors may agree with.
const VERIFICATION: i64 = 2048;

/// Rounds of refinement of a pose.
const ROUNDS: usize = 3;

/// Searches among up to `SEEN` seen reflectors.
#[derive(Clone, Debug)]
pub struct ReflectorRelocalizer<const SEEN: usize = 64> {
    parameters: RelocalizationParameters,
    seen: Vec<SeenReflector, SEEN>,
    sought: SoughtPairs,
    /// Reflectors that an answer must explain.
    needed: usize,
    /// The mapped pair that is looked at next.
    at: (usize, usize),
    /// How much of it has been tried: two hypotheses for each sought pair.
    tried: u8,
    /// Effort that was spent beyond what was allowed.
    debt: u32,
    best: Vec<ReflectorFix, KEPT>,
}

impl<const SEEN: usize> ReflectorRelocalizer<SEEN> {
    /// A relocaliser with nothing to do.
    #[must_use]
    pub const fn new(parameters: RelocalizationParameters) -> Self {
        Self {
            parameters,
            seen: Vec::new(),
            sought: SoughtPairs::new(),
            needed: 0,
            at: (0, 1),
            tried: 0,
            debt: 0,
            best: Vec::new(),
        }
    }

    /// Starts a search for the pose of the snapshot's frame; one that is under way is given up.
    pub fn begin(&mut self, snapshot: &ReflectorSnapshot<SEEN>, reflectors: &IndexedReflectors) {
        self.seen.clear();
        // Both have the same room.
        let _ = self.seen.extend_from_slice(snapshot.reflectors());
        self.sought.clear();
        self.best.clear();
        self.at = (0, 1);
        self.tried = 0;
        self.debt = 0;
        let count = self.seen.len();
        self.needed = usize::from(self.parameters.fewest).max(count.div_ceil(2));
        if count >= self.needed {
            self.choose_pairs(reflectors);
        }
    }

    /// Goes on with the search until `effort` is spent: a look at a mapped pair is one, about 15 instructions. What a last
    /// piece of work, at most the verification of one hypothesis, takes beyond it is spent of the next call's.
    pub fn advance(&mut self, reflectors: &IndexedReflectors, effort: u32) -> RelocalizationProgress {
        if self.seen.len() < self.needed || self.needed == 0 {
            return RelocalizationProgress::Done(ReflectorAnswer::TooFew);
        }
        let mut left = i64::from(effort) - i64::from(self.debt);
        self.debt = 0;
        let landmarks = reflectors.landmarks();
        while let Some(first) = landmarks.get(self.at.0) {
            for second in landmarks.get(self.at.1..).unwrap_or_default() {
                if left <= 0 {
                    return self.pause(left);
                }
                left -= 1;
                let (x, y) = (second.x - first.x, second.y - first.y);
                let square = (x * x + y * y) as f32;
                if self.sought.may_hold(square) && !self.try_pair(reflectors, first, second, square, &mut left) {
                    return self.pause(left);
                }
                self.at.1 += 1;
            }
            self.at = (self.at.0 + 1, self.at.0 + 2);
        }
        RelocalizationProgress::Done(self.answer())
    }

    /// Effort that the last piece of work took beyond what was allowed; the next call of [`Self::advance`] has so much less.
    #[must_use]
    pub const fn debt(&self) -> u32 {
        self.debt
    }

    fn pause(&mut self, left: i64) -> RelocalizationProgress {
        self.debt = u32::try_from(-left).unwrap_or(u32::MAX);
        RelocalizationProgress::Searching
    }

    /// Tries what a mapped pair may be, either way around, from where it was left while there is effort left. Whether all
    /// has been tried.
    #[inline(never)]
    fn try_pair(
        &mut self,
        reflectors: &IndexedReflectors,
        first: &Landmark,
        second: &Landmark,
        square: f32,
        left: &mut i64,
    ) -> bool {
        let origin = reflectors.origin();
        let from_origin = |landmark: &Landmark| (landmark.position() - origin).cast();
        let (p, q): (ScanPoint, ScanPoint) = (from_origin(first), from_origin(second));
        while let Some(pair) = self.sought.pairs().get(usize::from(self.tried / 2)).copied() {
            let position = |number: u8| self.seen.get(usize::from(number)).map(|seen| seen.position);
            let is_like = (pair.least..=pair.largest).contains(&square);
            let (true, Some(a), Some(b)) = (is_like, position(pair.first), position(pair.second)) else {
                *left -= 1;
                self.tried += 2;
                continue;
            };
            let is_turned = self.tried % 2 == 1;
            *left -= if is_turned { HYPOTHESIS } else { HYPOTHESIS + 1 };
            self.tried += 1;
            if let Some(transform) = Transform::between((a, b), if is_turned { (q, p) } else { (p, q) })
                && self.is_promising(reflectors, &transform)
            {
                *left -= VERIFICATION;
                if let Some(fix) = self.verify(reflectors, transform.pose(), (a, b)) {
                    self.keep(fix);
                }
            }
            if *left <= 0 {
                return false;
            }
        }
        self.tried = 0;
        true
    }

    /// Splits the seen reflectors into groups, cheapest pairs first, and notes the pairs within groups.
    fn choose_pairs(&mut self, reflectors: &IndexedReflectors) {
        let groups = {
            let mut costs = [[0.0; SEEN]; SEEN];
            for (first, row) in costs.iter_mut().enumerate().take(self.seen.len()) {
                for (second, cost) in row.iter_mut().enumerate().take(self.seen.len()) {
                    *cost = self.cost(reflectors.distances, first, second);
                }
            }
            Groups::new(&costs, self.seen.len(), self.needed - 1)
        };
        for second in 1..self.seen.len() {
            for first in 0..second {
                if groups.are_together(first, second)
                    && let Some((distance, tolerance)) = self.distance(first, second)
                {
                    let least = (distance - tolerance).max(0.0);
                    let largest = distance + tolerance;
                    self.sought.push(SoughtPair {
                        first: first as u8,
                        second: second as u8,
                        least: least * least,
                        largest: largest * largest,
                    });
                }
            }
        }
    }
    /// Distance of two seen reflectors, and by how much that of the mapped ones may differ, m.
    fn distance(&self, first: usize, second: usize) -> Option<(f32, f32)> {
        let (a, b) = (self.seen.get(first)?, self.seen.get(second)?);
        Some(((a.position - b.position).norm(), self.parameters.gate * libm::sqrtf(a.variance + b.variance)))
    }

    /// About how many mapped pairs are like a seen one; those that say little of the heading cost more.
    fn cost(&self, distances: &DistanceHistogram, first: usize, second: usize) -> f32 {
        let (Some(a), Some(b)) = (self.seen.get(first), self.seen.get(second)) else { return f32::INFINITY };
        let square = (a.position - b.position).norm_squared();
        let deviation = self.parameters.gate * libm::sqrtf(square * (a.variance + b.variance));
        let penalty = if square < SHORT_BASELINE * SHORT_BASELINE { SHORT_PENALTY } else { 0.0 };
        distances.count(square, 2.0 * deviation) + penalty
    }

    /// Whether enough of the seen reflectors may have one of the map near them.
    fn is_promising(&self, reflectors: &IndexedReflectors, transform: &Transform) -> bool {
        let mut misses = 0;
        let most = self.seen.len() - self.needed;
        self.seen.iter().all(|seen| {
            misses += usize::from(!reflectors.may_be_near(transform.apply(&seen.position)));
            misses <= most
        })
    }

    /// Refines a pose, which is that of two seen reflectors, by all reflectors that it explains. None if they are too few.
    #[inline(never)]
    fn verify(
        &self,
        reflectors: &IndexedReflectors,
        start: Pose,
        pair: (ScanPoint, ScanPoint),
    ) -> Option<ReflectorFix> {
        let mut pose = start;
        let mut covariance = nalgebra::Matrix3::zeros();
        let most_misses = self.seen.len() - self.needed;
        let middle = (pair.0 + pair.1) * 0.5;
        let leverage = 2.0 / (pair.1 - pair.0).norm();
        for round in 0..ROUNDS {
            let transform = Transform::of(&pose);
            let mut pairs = Vec::<(ScanPoint, ScanPoint, f32), SEEN>::new();
            for (number, seen) in self.seen.iter().enumerate() {
                // The heading of two reflectors errs; the gate is narrower as soon as more take part.
                let lever = if round == 0 { 1.0 + leverage * (seen.position - middle).norm() } else { 1.0 };
                let reach = self.parameters.gate * lever * libm::sqrtf(2.0 * seen.variance) + SLACK;
                if let Some(mapped) = reflectors.nearest(transform.apply(&seen.position), reach.min(LARGEST_REACH)) {
                    let _ = pairs.push((seen.position, mapped, 1.0 / seen.variance));
                } else if number + 1 - pairs.len() > most_misses {
                    return None;
                }
            }
            let points = pairs.iter().map(|(seen, mapped, weight)| (seen.cast(), mapped.cast(), f64::from(*weight)));
            let alignment = fit_rigid(points)?;
            pose = alignment.pose;
            covariance = alignment.unit_covariance;
        }
        let transform = Transform::of(&pose);
        let (mut matched, mut log_likelihood) = (0, 0.0);
        for seen in &self.seen {
            let reach = (self.parameters.gate * libm::sqrtf(seen.variance)).min(LARGEST_REACH);
            let Some(mapped) = reflectors.nearest(transform.apply(&seen.position), reach) else { continue };
            let square = (mapped - transform.apply(&seen.position)).norm_squared() / seen.variance;
            let area = core::f32::consts::TAU * seen.variance;
            matched += 1;
            log_likelihood += -libm::logf(self.parameters.false_density * area) - 0.5 * square;
        }
        let is_enough = usize::from(matched) >= self.needed;
        let origin = reflectors.origin();
        let pose = Pose::new(origin.x + pose.x, origin.y + pose.y, pose.theta);
        is_enough.then_some(ReflectorFix { pose, covariance, matched, log_likelihood })
    }

    /// Keeps a pose among the best distinct ones.
    fn keep(&mut self, fix: ReflectorFix) {
        if let Some(same) = self.best.iter_mut().find(|other| is_same(&self.parameters, &other.pose, &fix.pose)) {
            if fix.log_likelihood > same.log_likelihood {
                *same = fix;
            }
        } else {
            if self.best.is_full() {
                let least = self.best.last().map_or(f32::NEG_INFINITY, |last| last.log_likelihood);
                if fix.log_likelihood <= least {
                    return;
                }
                let _ = self.best.pop();
            }
            let _ = self.best.push(fix);
        }
        insertion_sort_by(&mut self.best, |a, b| b.log_likelihood.total_cmp(&a.log_likelihood));
    }

    fn answer(&self) -> ReflectorAnswer {
        let Some(best) = self.best.first() else { return ReflectorAnswer::Unknown };
        // Poses that explain fewer than the search looks for are not known; the best of them may explain one less.
        let unseen = best.log_likelihood * (self.needed - 1) as f32 / f32::from(best.matched);
        match self.best.iter().skip(1).find(|other| !is_same(&self.parameters, &other.pose, &best.pose)) {
            Some(second) if best.log_likelihood - second.log_likelihood < self.parameters.least_gap => {
                ReflectorAnswer::Ambiguous(*best, *second)
            }
            _ if best.log_likelihood - unseen < self.parameters.least_gap => ReflectorAnswer::Unknown,
            _ => ReflectorAnswer::Found(*best),
        }
    }
}

/// How far beyond the noise a reflector may lie from the map while the pose is refined, m.
const SLACK: f32 = 0.02;

fn is_same(parameters: &RelocalizationParameters, first: &Pose, second: &Pose) -> bool {
    let (shift, turn) = parameters.same_pose;
    (first.position() - second.position()).norm() < shift && libm::fabs(difference(first.theta, second.theta)) < turn
}

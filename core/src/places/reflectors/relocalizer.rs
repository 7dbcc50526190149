//! The search: complete, bounded, and able to pause.
//!
//! An answer must explain at least half of the reflectors seen. Of n reflectors of which k are explained, split into k - 1
//! groups, two explained ones share a group: it suffices to look up the pairs within groups, about n / 2 of them. Every
//! pose that explains k is found so, the best and the runner-up alike, and only a clear gap between the two makes an
//! answer.

use heapless::Vec;

use super::{ReflectorAnswer, ReflectorFix, ReflectorIndex, ReflectorSnapshot, SeenReflector};
use crate::geometry::{Pose, ScanPoint, difference};
use crate::places::align;
use crate::places::correspondence::Transform;

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

/// Pairs of seen reflectors that are looked up.
const PAIRS: usize = 96;

/// Poses that are kept for the comparison.
const KEPT: usize = 8;

/// A baseline shorter than this, m, says little of the heading, and is looked up last.
const SHORT_BASELINE: f32 = 4.0;

/// Lookups that a short baseline may save to be preferred all the same.
const SHORT_PENALTY: f32 = 40.0;

/// Rounds of refinement of a pose.
const ROUNDS: usize = 3;

/// Searches among up to `SEEN` seen reflectors.
#[derive(Clone, Debug)]
pub struct ReflectorRelocalizer<const SEEN: usize = 64> {
    parameters: RelocalizationParameters,
    seen: Vec<SeenReflector, SEEN>,
    pairs: Vec<SeenPair, PAIRS>,
    /// Reflectors that an answer must explain.
    needed: usize,
    /// Where the search stands: number of the pair, position in its range, and whether the pair is turned around.
    at: (usize, u32, bool),
    best: Vec<ReflectorFix, KEPT>,
}

/// A pair of seen reflectors and the range of mapped pairs like it.
#[derive(Clone, Debug)]
struct SeenPair {
    first: u8,
    second: u8,
    mapped: core::ops::Range<u32>,
}

impl<const SEEN: usize> ReflectorRelocalizer<SEEN> {
    /// A relocaliser with nothing to do.
    #[must_use]
    pub const fn new(parameters: RelocalizationParameters) -> Self {
        Self { parameters, seen: Vec::new(), pairs: Vec::new(), needed: 0, at: (0, 0, false), best: Vec::new() }
    }

    /// Starts a search for the pose of the snapshot's frame; one that is under way is given up.
    pub fn begin<const REFLECTORS: usize, const INDEXED: usize>(
        &mut self,
        snapshot: &ReflectorSnapshot<SEEN>,
        index: &ReflectorIndex<REFLECTORS, INDEXED>,
    ) {
        self.seen.clear();
        self.seen.extend(snapshot.reflectors().iter().copied());
        self.pairs.clear();
        self.best.clear();
        self.at = (0, 0, false);
        let count = self.seen.len();
        self.needed = usize::from(self.parameters.fewest).max(count.div_ceil(2));
        if count < self.needed {
            return;
        }
        self.choose_pairs(index);
        self.at.1 = self.pairs.first().map_or(0, |pair| pair.mapped.start);
    }

    /// Goes on with the search for at most `most_hypotheses` hypotheses.
    pub fn advance<const REFLECTORS: usize, const INDEXED: usize>(
        &mut self,
        index: &ReflectorIndex<REFLECTORS, INDEXED>,
        most_hypotheses: u32,
    ) -> RelocalizationProgress {
        if self.seen.len() < self.needed || self.needed == 0 {
            return RelocalizationProgress::Done(ReflectorAnswer::TooFew);
        }
        for _ in 0..most_hypotheses {
            let (number, position, is_turned) = self.at;
            let Some(pair) = self.pairs.get(number) else {
                return RelocalizationProgress::Done(self.answer());
            };
            if position >= pair.mapped.end {
                let next = self.pairs.get(number + 1).map_or(0, |pair| pair.mapped.start);
                self.at = (number + 1, next, false);
                continue;
            }
            let (first, second) = (usize::from(pair.first), usize::from(pair.second));
            self.at = if is_turned { (number, position + 1, false) } else { (number, position, true) };
            let Some((one, other)) = index.pairs.pair(position) else { continue };
            let (one, other) = if is_turned { (other, one) } else { (one, other) };
            if let Some(transform) = self.hypothesis(index, (first, second), (one, other))
                && self.is_promising(index, &transform)
                && let Some(fix) = self.verify(index, transform.pose())
            {
                self.keep(fix);
            }
        }
        RelocalizationProgress::Searching
    }

    /// Splits the seen reflectors into groups, cheapest pairs first, and notes the pairs within groups.
    fn choose_pairs<const REFLECTORS: usize, const INDEXED: usize>(
        &mut self,
        index: &ReflectorIndex<REFLECTORS, INDEXED>,
    ) {
        let groups = self.needed - 1;
        let mut group_of = [u8::MAX; SEEN];
        let mut opened = 0_usize;
        // Disjoint pairs open the groups; a reflector is never left over while a group is still to be opened.
        while opened < groups {
            let mut cheapest: Option<(f32, usize, usize)> = None;
            for second in 1..self.seen.len() {
                for first in 0..second {
                    let is_free = |number: usize| group_of.get(number).is_some_and(|group| *group == u8::MAX);
                    if is_free(first) && is_free(second) {
                        let cost = self.cost(index, first, second);
                        if cheapest.is_none_or(|(least, _, _)| cost < least) {
                            cheapest = Some((cost, first, second));
                        }
                    }
                }
            }
            let Some((_, first, second)) = cheapest else { break };
            for number in [first, second] {
                if let Some(group) = group_of.get_mut(number) {
                    *group = opened as u8;
                }
            }
            opened += 1;
        }
        // A last single one is a group of its own if one may still be opened, else it joins the cheapest group.
        for number in 0..self.seen.len() {
            if group_of.get(number).is_none_or(|group| *group != u8::MAX) {
                continue;
            }
            let mut joined = opened as u8;
            if opened < groups {
                opened += 1;
            } else {
                let mut least = f32::INFINITY;
                for group in 0..opened as u8 {
                    let members = group_of.iter().enumerate().filter(|(_, of)| **of == group);
                    let cost: f32 = members.map(|(member, _)| self.cost(index, member, number)).sum();
                    if cost < least || joined == opened as u8 {
                        (least, joined) = (cost, group);
                    }
                }
            }
            if let Some(group) = group_of.get_mut(number) {
                *group = joined;
            }
        }
        for second in 1..self.seen.len() {
            for first in 0..second {
                if group_of.get(first) == group_of.get(second)
                    && let Some(mapped) = self.like(index, first, second)
                {
                    let _ = self.pairs.push(SeenPair { first: first as u8, second: second as u8, mapped });
                }
            }
        }
    }

    /// Mapped pairs that have the distance of a seen pair.
    fn like<const REFLECTORS: usize, const INDEXED: usize>(
        &self,
        index: &ReflectorIndex<REFLECTORS, INDEXED>,
        first: usize,
        second: usize,
    ) -> Option<core::ops::Range<u32>> {
        let (a, b) = (self.seen.get(first)?, self.seen.get(second)?);
        let tolerance = self.parameters.gate * libm::sqrtf(a.variance + b.variance);
        index.pairs.range((a.position - b.position).norm(), tolerance)
    }

    /// What it costs to look up a pair.
    fn cost<const REFLECTORS: usize, const INDEXED: usize>(
        &self,
        index: &ReflectorIndex<REFLECTORS, INDEXED>,
        first: usize,
        second: usize,
    ) -> f32 {
        let (Some(a), Some(b)) = (self.seen.get(first), self.seen.get(second)) else { return f32::INFINITY };
        let Some(mapped) = self.like(index, first, second) else { return 1e9 };
        let is_short = (a.position - b.position).norm() < SHORT_BASELINE;
        mapped.len() as f32 + if is_short { SHORT_PENALTY } else { 0.0 }
    }

    /// The pose that puts two seen reflectors on two mapped ones.
    fn hypothesis<const REFLECTORS: usize, const INDEXED: usize>(
        &self,
        index: &ReflectorIndex<REFLECTORS, INDEXED>,
        seen: (usize, usize),
        mapped: (u16, u16),
    ) -> Option<Transform> {
        let (a, b) = (self.seen.get(seen.0)?.position, self.seen.get(seen.1)?.position);
        let (p, q) = (index.points.get(usize::from(mapped.0))?, index.points.get(usize::from(mapped.1))?);
        Transform::between((a, b), (*p, *q))
    }

    /// Whether enough of the seen reflectors may have one of the map near them.
    fn is_promising<const REFLECTORS: usize, const INDEXED: usize>(
        &self,
        index: &ReflectorIndex<REFLECTORS, INDEXED>,
        transform: &Transform,
    ) -> bool {
        let mut misses = 0;
        let most = self.seen.len() - self.needed;
        self.seen.iter().all(|seen| {
            misses += usize::from(!index.occupancy.is_near(transform.apply(&seen.position)));
            misses <= most
        })
    }

    /// Refines a pose by all reflectors that it explains. None if they are too few.
    fn verify<const REFLECTORS: usize, const INDEXED: usize>(
        &self,
        index: &ReflectorIndex<REFLECTORS, INDEXED>,
        start: Pose,
    ) -> Option<ReflectorFix> {
        let mut pose = start;
        let mut covariance = nalgebra::Matrix3::zeros();
        for round in 0..ROUNDS {
            let transform = Transform::of(&pose);
            // A pose from two reflectors errs; the gate narrows as more take part.
            let slack = if round == 0 { FIRST_SLACK } else { SLACK };
            let mut pairs = Vec::<(ScanPoint, ScanPoint, f32), SEEN>::new();
            for seen in &self.seen {
                let reach = (self.parameters.gate * libm::sqrtf(2.0 * seen.variance) + slack).min(LARGEST_REACH);
                if let Some(mapped) = self.mapped(index, &transform, seen, reach) {
                    let _ = pairs.push((seen.position, mapped, 1.0 / seen.variance));
                }
            }
            if pairs.len() < self.needed {
                return None;
            }
            let points = pairs.iter().map(|(seen, mapped, weight)| (seen.cast(), mapped.cast(), f64::from(*weight)));
            let alignment = align(points)?;
            pose = alignment.pose;
            covariance = alignment.unit_covariance;
        }
        let transform = Transform::of(&pose);
        let (mut matched, mut log_likelihood) = (0, 0.0);
        for seen in &self.seen {
            let reach = (self.parameters.gate * libm::sqrtf(seen.variance)).min(LARGEST_REACH);
            let Some(mapped) = self.mapped(index, &transform, seen, reach) else { continue };
            let square = (mapped - transform.apply(&seen.position)).norm_squared() / seen.variance;
            let area = core::f32::consts::TAU * seen.variance;
            matched += 1;
            log_likelihood += -libm::logf(self.parameters.false_density * area) - 0.5 * square;
        }
        let is_enough = usize::from(matched) >= self.needed;
        is_enough.then_some(ReflectorFix { pose, covariance, matched, log_likelihood })
    }

    fn mapped<const REFLECTORS: usize, const INDEXED: usize>(
        &self,
        index: &ReflectorIndex<REFLECTORS, INDEXED>,
        transform: &Transform,
        seen: &SeenReflector,
        reach: f32,
    ) -> Option<ScanPoint> {
        let (number, _) = index.nearest(transform.apply(&seen.position), reach)?;
        index.points.get(usize::from(number)).copied()
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
        self.best.sort_unstable_by(|a, b| b.log_likelihood.total_cmp(&a.log_likelihood));
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

/// How far beyond the noise a reflector may lie from the map in the first round of refinement, m.
const FIRST_SLACK: f32 = 0.3;

/// The same in later rounds, m.
const SLACK: f32 = 0.02;

/// Farthest that a reflector is looked for, m.
const LARGEST_REACH: f32 = 0.6;

fn is_same(parameters: &RelocalizationParameters, first: &Pose, second: &Pose) -> bool {
    let (shift, turn) = parameters.same_pose;
    (first.position() - second.position()).norm() < shift && libm::fabs(difference(first.theta, second.theta)) < turn
}

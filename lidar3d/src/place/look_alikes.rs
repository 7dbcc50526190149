//! From which score on an answer is believed, learnt from the scores of places of the map with others that lie apart.
//!
//! What lies outside the map looks as much like its places as these look like each other. The greatest of a hundred scores says
//! little of one in a thousand, so the tail is continued beyond what was seen: by how much scores exceed a threshold is
//! distributed by generalised Pareto, whose parameters are found by moments (Hosking and Wallis 1987). Scores have a greatest
//! possible value, so the tail is at the most exponential.
//!
//! Some places have a twin, such as opposite corners of a hall, and others look like none. So how alike a place is to others also
//! foretells how alike it may be to what lies outside: a line is laid through the scores of both, and the tail of what is above
//! it continued.

use std::vec::Vec;

/// Part of the scores that are the tail.
const TAIL: f32 = 0.1;
/// Part of the scores that lie above the limit.
const EXCEEDED: f32 = 0.001;
/// Below this a tail is as good as exponential.
const EXPONENTIAL: f32 = 1e-3;
/// Fewer pairs say nothing of a line.
const PAIRS: usize = 20;

/// A place of the map, taken for another one that lies apart.
#[derive(Clone, Copy, Debug)]
pub(super) struct LookAlike {
    /// Its score there.
    pub score: f32,
    /// The greatest score of that other place with those that lie apart from both.
    pub other: f32,
}

/// From which score on an answer is believed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScoreLimit {
    /// Whatever the place looks like.
    pub always: f32,
    /// At a place that is like no other one of the map,
    pub unlike: f32,
    /// and by how much more per score that the place has with another one.
    pub slope: f32,
}

impl ScoreLimit {
    /// Believes whatever agrees better than the place does with others of the map.
    pub const NONE: Self = Self { always: 0.0, unlike: 0.0, slope: 0.0 };

    /// That of which one in a thousand look-alikes is believed; [`Self::NONE`] without any.
    pub(super) fn learnt(look_alikes: &[LookAlike]) -> Self {
        let always = limit(look_alikes.iter().map(|pair| pair.score).collect());
        let slope = slope(look_alikes);
        let above = look_alikes.iter().map(|pair| pair.score - slope * pair.other).collect();
        let unlike = if look_alikes.len() < PAIRS { always } else { limit(above) };
        Self { always, unlike, slope }
    }

    /// Whether the score of an answer is believed at a place that has a score of `look_alike` with another one of the map.
    #[must_use]
    pub fn believes(&self, score: f32, look_alike: f32) -> bool {
        score > look_alike && score > self.always.min(self.unlike + self.slope * look_alike)
    }
}

/// Slope of the line through the scores of both places, by least squares.
fn slope(pairs: &[LookAlike]) -> f32 {
    let count = pairs.len().max(1) as f32;
    let mean = |of: fn(&LookAlike) -> f32| pairs.iter().map(of).sum::<f32>() / count;
    let (score, other) = (mean(|pair| pair.score), mean(|pair| pair.other));
    let square: f32 = pairs.iter().map(|pair| (pair.other - other) * (pair.other - other)).sum();
    let both: f32 = pairs.iter().map(|pair| (pair.other - other) * (pair.score - score)).sum();
    if pairs.len() < PAIRS || square <= 0.0 { 0.0 } else { both / square }
}

/// The score that one in a thousand exceeds; 0 of none.
fn limit(mut scores: Vec<f32>) -> f32 {
    scores.sort_by(|a, b| b.total_cmp(a));
    let count = (libm::ceilf(TAIL * scores.len() as f32) as usize).min(scores.len().saturating_sub(1));
    let Some((tail, threshold)) = scores.get(..count).zip(scores.get(count)) else { return 0.0 };
    let excess = || tail.iter().map(|score| score - threshold);
    let mean = excess().sum::<f32>() / count.max(1) as f32;
    let variance = excess().map(|excess| (excess - mean) * (excess - mean)).sum::<f32>() / (count.max(2) - 1) as f32;
    if mean <= 0.0 || variance <= 0.0 {
        return scores.first().copied().unwrap_or(0.0);
    }
    let share = (count as f32 / scores.len() as f32 / EXCEEDED).max(1.0);
    // How much shorter than exponential the tail is.
    let shortness = (0.5 * (mean * mean / variance - 1.0)).max(0.0);
    let scale = mean * (1.0 + shortness);
    let beyond =
        if shortness < EXPONENTIAL { libm::logf(share) } else { (1.0 - libm::powf(share, -shortness)) / shortness };
    threshold + scale * beyond
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of distributions whose tail is known.
    #[test]
    fn the_limit_is_that_of_the_distribution() {
        let count = 2000;
        let part = |number: usize| (number as f32 + 0.5) / count as f32;
        let exponential = limit((0..count).map(|number| 0.5 - 0.03 * libm::logf(part(number))).collect());
        assert!((exponential - (0.5 - 0.03 * libm::logf(EXCEEDED))).abs() < 0.01, "{exponential}");
        let even = limit((0..count).map(|number| 0.7 - 0.2 * part(number)).collect());
        assert!((even - (0.7 - 0.2 * EXCEEDED)).abs() < 0.002, "{even}");
        assert_eq!(limit(Vec::new()), 0.0);
        assert_eq!(limit([0.4].to_vec()), 0.4);
    }

    /// A hall whose corners look alike: what is believed elsewhere is not believed there.
    #[test]
    fn a_place_with_a_twin_has_a_higher_limit() {
        let off = |number: usize| 0.01 * (libm::sinf(12.9 * number as f32) + libm::sinf(7.3 * number as f32));
        let corner = |number: usize| LookAlike { score: 0.78 + off(number), other: 0.76 + off(number + 3) };
        let aisle = |number: usize| LookAlike { score: 0.55 + off(number), other: 0.54 + off(number + 5) };
        let pairs: Vec<LookAlike> = (0..16).map(corner).chain((0..84).map(aisle)).collect();
        let limit = ScoreLimit::learnt(&pairs);
        assert!(limit.believes(0.7, 0.55) && !limit.believes(0.7, 0.76), "{limit:?}");
        assert!(pairs.iter().filter(|pair| limit.believes(pair.score, pair.other)).count() <= 1, "{limit:?}");
        // Scores of all places at once know no corners.
        assert!(limit.always > 0.75, "{limit:?}");
        assert_eq!(ScoreLimit::learnt(&[]), ScoreLimit::NONE);
        let few = ScoreLimit::learnt(&pairs[..5]);
        assert_eq!((few.slope, few.unlike), (0.0, few.always));
    }
}

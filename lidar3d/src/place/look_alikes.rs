//! From which score on an answer is believed, learnt from the scores of places of the map with others that lie apart.
//!
//! What lies outside the map looks as much like its places as these look like each other. The greatest of a hundred scores says
//! little of one in five hundred, and a single outlier sets it; so the tail is continued beyond what was seen: scores above a
//! threshold exceed it by an exponential distribution (peaks over threshold, Davison and Smith 1990, with shape 0).

use std::vec::Vec;

/// Part of the scores that are the tail.
const TAIL: f32 = 0.1;
/// Part of the scores that lie above the limit.
const EXCEEDED: f32 = 0.002;

/// The score that one in five hundred look-alikes exceeds; 0 of none.
pub(super) fn limit(mut scores: Vec<f32>) -> f32 {
    scores.sort_by(|a, b| b.total_cmp(a));
    let count = (libm::ceilf(TAIL * scores.len() as f32) as usize).min(scores.len().saturating_sub(1));
    let Some(threshold) = scores.get(count).copied() else { return 0.0 };
    let above: f32 = scores.iter().take(count).map(|score| score - threshold).sum();
    let mean = above / count.max(1) as f32;
    let share = count.max(1) as f32 / scores.len() as f32;
    threshold + mean * libm::logf((share / EXCEEDED).max(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Quantiles of an exponential distribution, of which the limit is known.
    #[test]
    fn the_limit_is_that_of_the_distribution() {
        for count in [100, 1000] {
            let quantile = |number: usize| 0.5 - 0.03 * libm::logf((number as f32 + 0.5) / count as f32);
            let found = limit((0..count).map(quantile).collect());
            assert!((found - (0.5 - 0.03 * libm::logf(EXCEEDED))).abs() < 0.006, "{count}: {found}");
        }
        assert_eq!(limit(Vec::new()), 0.0);
        assert_eq!(limit([0.4].to_vec()), 0.4);
    }
}

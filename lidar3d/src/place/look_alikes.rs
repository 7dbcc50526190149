//! From which score on an answer is believed, learnt from the scores of places of the map with others that lie apart.
//!
//! What lies outside the map looks as much like its places as these look like each other. The greatest of a hundred scores says
//! little of one in a thousand, so the tail is continued beyond what was seen: by how much scores exceed a threshold is
//! distributed by generalised Pareto, whose parameters are found by moments (Hosking and Wallis 1987). Scores have a greatest
//! possible value, so the tail is at the most exponential.

use std::vec::Vec;

/// Part of the scores that are the tail.
const TAIL: f32 = 0.1;
/// Part of the scores that lie above the limit.
const EXCEEDED: f32 = 0.001;
/// Below this a tail is as good as exponential.
const EXPONENTIAL: f32 = 1e-3;

/// The score that one in a thousand look-alikes exceeds; 0 of none.
pub(super) fn limit(mut scores: Vec<f32>) -> f32 {
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
}

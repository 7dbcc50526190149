//! From which agreement on an answer is believed, learnt from the places of a map alone.
//!
//! Two places that lie apart agree in what is built alike: walls, posts, aisles. A place and its neighbours agree in all that they
//! see. A scan that is made later lies between: what has changed since contradicts. And so does one of a place that is not in the map but
//! built like one that is, in whatever stands there. The limit lies at a part of the way from one to the other. Medians tell it
//! well from a hundred places; their greatest agreements do not, as a hall may have a twin of a place that the map has not.

use std::vec::Vec;

/// Part of the way from places that look alike to neighbours.
const PART: f32 = 0.4;

/// The limit, of how much places agree with others that look alike, and with their neighbours; 0 if either is unknown.
pub(super) fn limit(alike: Vec<f32>, same: Vec<f32>) -> f32 {
    match (median(alike), median(same)) {
        (Some(alike), Some(same)) => alike + PART * (same - alike).max(0.0),
        (Some(alike), None) => alike,
        (None, _) => 0.0,
    }
}

fn median(mut values: Vec<f32>) -> Option<f32> {
    values.sort_by(f32::total_cmp);
    values.get(values.len() / 2).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_limit_lies_between_places_that_look_alike_and_neighbours() {
        let alike = [0.6, 0.2, 0.7, 0.6, 0.95].to_vec();
        assert!((limit(alike.clone(), [1.0, 0.9, 1.0].to_vec()) - 0.76).abs() < 1e-6);
        // Neighbours that agree less than others, and none.
        assert_eq!(limit(alike.clone(), [0.5].to_vec()), 0.6);
        assert_eq!(limit(alike, Vec::new()), 0.6);
        assert_eq!(limit(Vec::new(), [1.0].to_vec()), 0.0);
    }
}

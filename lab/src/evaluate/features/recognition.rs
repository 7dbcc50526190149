//! How well descriptors tell keypoints apart (K 3.3.2).

use serde::Serialize;

/// One descriptor of one scan compared with one of another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Comparison {
    /// Distance of the descriptors.
    pub distance: f32,
    /// Whether both are of the same point of the world.
    pub is_same: bool,
}

/// Precision and recall at one threshold.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct RecognitionPoint {
    /// Descriptors at most this far apart match.
    pub threshold: f32,
    /// Share of the matches that are of the same point.
    pub precision: f64,
    /// Share of the pairs of the same point that match.
    pub recall: f64,
}

/// Points of a curve that are kept.
const CURVE_POINTS: usize = 40;

/// Precision and recall over the threshold, the strictest first.
#[must_use]
pub fn curve(comparisons: &mut [Comparison]) -> Vec<RecognitionPoint> {
    comparisons.sort_by(|a, b| a.distance.total_cmp(&b.distance));
    let all = comparisons.iter().filter(|comparison| comparison.is_same).count();
    let mut points = Vec::new();
    let mut right = 0;
    for (index, comparison) in comparisons.iter().enumerate() {
        right += usize::from(comparison.is_same);
        // Comparisons of equal distance match together.
        if comparisons.get(index + 1).is_none_or(|next| next.distance > comparison.distance) {
            points.push(RecognitionPoint {
                threshold: comparison.distance,
                precision: right as f64 / (index + 1) as f64,
                recall: right as f64 / all.max(1) as f64,
            });
        }
    }
    thinned(&points)
}

/// Points whose recall is at least a fixed step apart, and the last one.
fn thinned(points: &[RecognitionPoint]) -> Vec<RecognitionPoint> {
    let mut kept: Vec<RecognitionPoint> = Vec::new();
    for (index, point) in points.iter().enumerate() {
        let is_far = kept.last().is_none_or(|last| point.recall - last.recall >= 1.0 / CURVE_POINTS as f64);
        if is_far || index + 1 == points.len() {
            kept.push(*point);
        }
    }
    kept
}

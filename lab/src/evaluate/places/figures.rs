//! Precision and recall.

use serde::Serialize;

/// One answered question.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Judged {
    /// What the method thinks of its answer; larger is surer.
    pub score: f64,
    /// Keypoints that support it.
    pub points: usize,
    /// Whether it is right.
    pub is_right: bool,
    /// Whether the question counts for recall.
    pub counts: bool,
}

/// Precision and recall at one threshold.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CurvePoint {
    /// Answers with at least this score are accepted.
    pub threshold: f64,
    /// Share of the accepted answers that are right.
    pub precision: f64,
    /// Share of the questions that count which got a right answer.
    pub recall: f64,
}

/// How good the answers are.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Figures {
    /// Precision at the stated threshold; one if nothing is accepted.
    pub precision: f64,
    /// Recall at the stated threshold.
    pub recall: f64,
    /// Largest recall with a precision of at least 0.95.
    pub r95: f64,
    /// Largest recall with a precision of at least 0.99.
    pub r99: f64,
    /// Largest harmonic mean of precision and recall.
    pub max_f1: f64,
    /// Precision and recall over the threshold, the strictest first.
    pub curve: Vec<CurvePoint>,
}

/// Rates answers; `questions` count for recall. The stated precision and recall are those of the answers for which
/// `is_accepted` holds; the curve runs over the score.
#[must_use]
pub fn figures(answers: &[Judged], questions: usize, is_accepted: impl Fn(&Judged) -> bool) -> Figures {
    let rate = |accepted: usize, right: usize, found: usize| {
        let precision = if accepted == 0 { 1.0 } else { right as f64 / accepted as f64 };
        let recall = if questions == 0 { 0.0 } else { found as f64 / questions as f64 };
        (precision, recall)
    };
    let accepted: Vec<_> = answers.iter().filter(|answer| is_accepted(answer)).collect();
    let right = accepted.iter().filter(|answer| answer.is_right);
    let (precision, recall) = rate(accepted.len(), right.clone().count(), right.filter(|answer| answer.counts).count());

    let mut sorted: Vec<_> = answers.to_vec();
    sorted.sort_by(|a, b| b.score.total_cmp(&a.score));
    let (mut right, mut found) = (0, 0);
    let mut curve = Vec::new();
    for (index, answer) in sorted.iter().enumerate() {
        right += usize::from(answer.is_right);
        found += usize::from(answer.is_right && answer.counts);
        // Answers of equal score are accepted together.
        if sorted.get(index + 1).is_none_or(|next| next.score < answer.score) {
            let (precision, recall) = rate(index + 1, right, found);
            curve.push(CurvePoint { threshold: answer.score, precision, recall });
        }
    }
    let at = |least: f64| {
        curve.iter().filter(|point| point.precision >= least).map(|point| point.recall).fold(0.0, f64::max)
    };
    let f1 = |point: &CurvePoint| 2.0 * point.precision * point.recall / (point.precision + point.recall).max(1e-9);
    let max_f1 = curve.iter().map(f1).fold(0.0, f64::max);
    Figures { precision, recall, r95: at(0.95), r99: at(0.99), max_f1, curve }
}

//! A pose, as its telegrams say it.

use agv_core::integrity::AlertLimits;
use agv_core::state::PoseOutput;

use super::content::{Content, Health};

/// What is said of a pose: position, heading, covariance, status, integrity.
#[must_use]
pub fn contents(pose: &PoseOutput, health: &Health, limits: &AlertLimits) -> [Content; 5] {
    let level = pose.level;
    let [xx, xy, yy, x_heading, y_heading, heading] = pose.covariance;
    let deviations = [xx, yy, heading].map(libm::sqrt);
    let [x, y, turn] = deviations;
    // Without a deviation there is nothing to correlate.
    let correlation = |covariance: f64, product: f64| {
        if product > 0.0 { (covariance / product).clamp(-1.0, 1.0) } else { 0.0 }
    };
    [
        Content::Position { x: pose.pose.x, y: pose.pose.y },
        Content::Heading {
            heading: pose.pose.theta,
            time: (pose.time.micros() / 1000) as u16,
            dead_reckoning_distance: pose.dead_reckoning_distance,
        },
        Content::Covariance {
            deviations,
            correlations: [correlation(xy, x * y), correlation(x_heading, x * turn), correlation(y_heading, y * turn)],
        },
        Content::Status {
            mode: pose.mode,
            reason: pose.reason,
            acceptance: pose.acceptance,
            normalised_square: pose.normalised_square,
            health: *health,
            is_good: pose.is_good(),
            has_jumped: pose.has_jumped(),
            resets: pose.resets,
            last_reset: f64::from(pose.last_reset),
            overflows: pose.overflows,
        },
        Content::Integrity { level, limit: limits.travel, alarm: limits.alarm(pose.mode, &level) },
    ]
}

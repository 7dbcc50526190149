//! The pose, as it is said again and again.

use agv_core::integrity::AlertLimits;
use agv_core::measurement::Time;
use agv_core::state::PoseOutput;

use super::content::{Content, Health};
use crate::can::canopen::NodeId;
use crate::can::frame::Frame;

/// Time between two poses on the bus, s.
pub const PERIOD: f64 = 0.010;

/// Highest value of the counter.
const LAST_COUNT: u8 = 15;

/// Says the pose every 10 ms.
#[derive(Clone, Copy, Debug)]
pub struct PosePublisher {
    node: NodeId,
    limits: AlertLimits,
    counter: u8,
    next: Time,
}

impl PosePublisher {
    /// A publisher at `node` that begins at `start`, of a vehicle that can live with `limits`.
    #[must_use]
    pub const fn new(node: NodeId, limits: AlertLimits, start: Time) -> Self {
        Self { node, limits, counter: 0, next: start }
    }

    /// When the next pose is due.
    #[must_use]
    pub const fn next(&self) -> Time {
        self.next
    }

    /// The frames of a pose, if one is due: position, heading, covariance, status, integrity. Poses that were missed are left out.
    pub fn poll(&mut self, now: Time, pose: &PoseOutput, health: &Health) -> Option<[Frame; 5]> {
        if now < self.next {
            return None;
        }
        let following = self.next.offset(PERIOD);
        self.next = if following <= now { now.offset(PERIOD) } else { following };
        let contents = contents(pose, health, &self.limits);
        let frames = contents.map(|content| content.encode(self.node, self.counter));
        self.counter = if self.counter >= LAST_COUNT { 0 } else { self.counter + 1 };
        Some(frames)
    }
}

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

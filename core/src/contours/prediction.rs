//! Where the odometry has the laser, and how wrong that may be.

use super::SearchWindow;
use crate::geometry::Pose;

/// Random walk of the position, m for the root of a metre. These three are the largest of six robots, by their own recordings.
const POSITION: f64 = 0.08;

/// Random walk of the heading, rad for the root of a metre.
const HEADING: f64 = 0.094;

/// Error of a turn, rad a radian: a turn on the spot has it too.
const TURN: f64 = 0.34;

/// A pose by odometry.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prediction {
    /// Pose of the laser.
    pub pose: Pose,
    /// Standard deviation of its position along an axis, m.
    pub position_deviation: f64,
    /// Standard deviation of its heading, rad.
    pub heading_deviation: f64,
}

impl Prediction {
    /// The pose behind a step of the odometry from a known pose.
    #[must_use]
    pub fn by_odometry(before: &Pose, step: &Pose) -> Self {
        let distance = libm::hypot(step.x, step.y);
        Self {
            pose: before.compose(step),
            position_deviation: POSITION * libm::sqrt(distance),
            heading_deviation: libm::hypot(HEADING * libm::sqrt(distance), TURN * step.theta),
        }
    }

    /// The same for a pose that is known as well as a filter says, a `step` of the odometry behind the scan before.
    #[must_use]
    pub fn of_filter(pose: Pose, position_deviation: f64, heading_deviation: f64, step: &Pose) -> Self {
        let by_step = Self::by_odometry(&Pose::default(), step);
        Self {
            pose,
            position_deviation: position_deviation.max(by_step.position_deviation),
            heading_deviation: heading_deviation.max(by_step.heading_deviation),
        }
    }

    /// What must be searched for it: three deviations, but no less than usual and no more than there is time for.
    #[must_use]
    pub fn window(&self) -> SearchWindow {
        let usual = SearchWindow::USUAL;
        let steps = |deviation: f64, step: f32, least: u8, most: u8| {
            let steps = libm::ceil(3.0 * deviation / f64::from(step));
            // A deviation that is no number asks for what is usual.
            if steps > f64::from(least) { steps.min(f64::from(most)) as u8 } else { least }
        };
        SearchWindow {
            shifts: steps(self.position_deviation, usual.step(), usual.shifts, 4),
            turns: steps(self.heading_deviation, usual.turn, usual.turns, 20),
            ..usual
        }
    }
}

//! Whether the wheels stand.

use serde::{Deserialize, Serialize};

use super::Motion;
use crate::geometry::Pose;
use crate::measurement::Time;

/// A vehicle whose wheels have not moved for so long stands, s.
const STANDS_AFTER: f64 = 0.5;
/// Wheels that tremble by no more than this stand: m and rad.
const TREMBLE: (f64, f64) = (5e-4, 5e-4);

/// Since when the wheels stand.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Rest {
    since: Time,
    /// Where the wheels have led since.
    moved: Pose,
}

/// Tells a vehicle that stands, whose gyro then tells its own bias and no turn.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub struct StandingWheels {
    rest: Option<Rest>,
    stands: bool,
}

impl StandingWheels {
    /// Wheels of which nothing is known: they stand until they move.
    #[must_use]
    pub const fn new() -> Self {
        Self { rest: None, stands: false }
    }

    /// Takes a motion of the wheels. True if they stand.
    pub fn add(&mut self, motion: &Motion) -> bool {
        let rest = self.rest.get_or_insert(Rest { since: motion.start.offset(-STANDS_AFTER), moved: Pose::default() });
        rest.moved = rest.moved.compose(&motion.displacement);
        let Pose { x, y, theta } = rest.moved;
        let (way, turn) = TREMBLE;
        if libm::fabs(x) > way || libm::fabs(y) > way || libm::fabs(theta) > turn {
            *rest = Rest { since: motion.end, moved: Pose::default() };
        }
        self.stands = motion.end.since(rest.since) >= STANDS_AFTER;
        self.stands
    }

    /// Nobody knows whether they stand.
    pub fn forget(&mut self) {
        *self = Self::new();
    }

    /// Whether they stood in the last motion.
    #[must_use]
    pub const fn stands(&self) -> bool {
        self.stands
    }
}

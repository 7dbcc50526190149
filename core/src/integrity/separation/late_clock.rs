//! A laser whose clock is off since the vehicle last stood, or since it was switched on: at rest that does nothing, so the pose was found right
//! then, and the first metre shows how late it is. Who finds itself while it moves has found where it was, until it stands, or moves
//! otherwise. A clock that goes wrong on the way is a matter of the free mounting.

use serde::{Deserialize, Serialize};

use super::UNKNOWN_POSE;
use super::assumed::AssumedDeviations;
use super::hypothesis::is_refuted;
use super::sensor_information::SensorInformation;
use super::solution::{Laser, Solution};

/// A vehicle stands that moves and turns no faster than this, m/s and rad/s: its pose is off by a millimetre at most.
const AT_REST: (f64, f64) = (5e-3, 5e-3);

/// The solution with a clock that is free since the vehicle last stood, or since its first pose; none before.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct LateClock {
    solution: Option<Solution>,
    /// Whether it begins with what is seen next, even if the vehicle moves.
    is_first: bool,
}

impl LateClock {
    /// Nothing is known before the vehicle stands; or, with its first pose, before it sees something.
    #[must_use]
    pub const fn new(is_first: bool) -> Self {
        Self { solution: None, is_first }
    }

    /// The solution.
    #[must_use]
    pub const fn solution(&self) -> Option<&Solution> {
        self.solution.as_ref()
    }

    /// The solution.
    pub const fn solution_mut(&mut self) -> Option<&mut Solution> {
        self.solution.as_mut()
    }

    /// Takes what landmarks say; `all` has taken it.
    pub fn correct(&mut self, told: &SensorInformation, laser: &Laser, all: &Solution, assumed: &AssumedDeviations) {
        let is_first = core::mem::take(&mut self.is_first);
        if let Some(solution) = &mut self.solution
            && is_refuted(solution.correct(told, laser))
        {
            self.solution = None;
        }
        if is_at_rest(laser) {
            // The clock may be another one from now on. Nothing but this solution is known to hold if it was wrong before.
            self.solution.get_or_insert_with(|| all.clone()).free_clock();
        } else if self.solution.is_none() && is_first {
            // The pose and the clock are known by one another alone.
            let mut solution = Solution::new(*all.pose(), &UNKNOWN_POSE, assumed);
            solution.free_clock();
            let _ = solution.correct(told, laser);
            self.solution = Some(solution);
        }
    }
}

fn is_at_rest(laser: &Laser) -> bool {
    let [x, y, turn] = [laser.velocity.x, laser.velocity.y, laser.velocity.z];
    libm::hypot(x, y) <= AT_REST.0 && libm::fabs(turn) <= AT_REST.1
}

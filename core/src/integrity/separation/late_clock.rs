//! A laser whose clock was off when the vehicle was switched on: at rest that does nothing, so the pose was found right then, and the first
//! metre shows how late it is. A clock that is off later is a matter of the free mounting.

use super::hypothesis::is_refuted;
use super::sensor_information::SensorInformation;
use super::solution::{Laser, Solution};

/// A vehicle stands that moves and turns no faster than this, m/s and rad/s: its pose is off by a millimetre at most.
const AT_REST: (f64, f64) = (5e-3, 5e-3);

/// The solution with a clock that is free since the vehicle stood; none before.
#[derive(Clone, Debug)]
pub struct LateClock {
    solution: Option<Solution>,
}

impl LateClock {
    /// Nothing is known before the vehicle stands.
    #[must_use]
    pub const fn new() -> Self {
        Self { solution: None }
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
    pub fn correct(&mut self, told: &SensorInformation, laser: &Laser, all: &Solution) {
        if let Some(solution) = &mut self.solution
            && is_refuted(solution.correct(told, laser))
        {
            self.solution = None;
        }
        if self.solution.is_none() && is_at_rest(laser) {
            let mut solution = all.clone();
            solution.free_clock();
            self.solution = Some(solution);
        }
    }
}

fn is_at_rest(laser: &Laser) -> bool {
    let [x, y, turn] = [laser.velocity.x, laser.velocity.y, laser.velocity.z];
    libm::hypot(x, y) <= AT_REST.0 && libm::fabs(turn) <= AT_REST.1
}

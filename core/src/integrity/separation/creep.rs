//! A laser that creeps on its mounting: slowly at any time, or so fast that it is found.

use serde::{Deserialize, Serialize};

use super::assumed::{Factors, ONE_FAULT, ONE_RARE_FAULT};
use super::envelope::Envelope;
use super::hypothesis::is_refuted;
use super::sensor_information::SensorInformation;
use super::solution::{Laser, Solution};
use crate::geometry::Pose;

/// A laser that creeps: its place, m, and yaw, rad, for a square root of a metre, or of two seconds.
const SLOW: (f64, f64) = (5e-4, 2.6e-4);
/// The same of one that creeps so fast that it is found.
const FAST: (f64, f64) = (3e-2, 1.7e-2);
/// One that only turns, by 0.6 deg: its place is where it was, so that the way driven tells the heading.
const TURNING: (f64, f64) = (0.0, 1e-2);
/// A fast one is found where the solutions lie further apart than so many deviations of what lies between them, in position and heading
/// together. They drift apart over some ten metres, so there are 1e4 looks in 100 km: without a fault it is found once in 1000 km.
const FOUND: f64 = 5.1;
/// The same of one that turns, which moves the heading alone: once in 1000 km, too.
const FOUND_TURNING: f64 = 4.5;

/// A fast creep, and whether it was found.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Sought {
    solution: Solution,
    found_from: f64,
    is_found: bool,
}

impl Sought {
    const fn new(solution: Solution, found_from: f64) -> Self {
        Self { solution, found_from, is_found: false }
    }

    fn begin(&mut self, all: &Solution) {
        if !self.is_found {
            self.solution = all.clone();
        }
    }

    fn correct(&mut self, told: &SensorInformation, laser: &Laser, all: &Solution) {
        if is_refuted(self.solution.correct(told, laser)) {
            self.solution = all.clone();
        }
        let from = if self.is_found { 0.5 * self.found_from } else { self.found_from };
        self.is_found = self.solution.separation(all) > from;
    }
}

/// The solutions whose laser creeps.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Creeps {
    slow: Solution,
    fast: Sought,
    turning: Sought,
}

impl Creeps {
    /// They begin as the solution from all that is measured.
    #[must_use]
    pub fn new(all: &Solution) -> Self {
        Self {
            slow: all.clone(),
            fast: Sought::new(all.clone(), FOUND),
            turning: Sought::new(all.clone(), FOUND_TURNING),
        }
    }

    /// Begins anew at the solution from all; what was found remains.
    pub fn begin(&mut self, all: &Solution) {
        self.slow = all.clone();
        self.fast.begin(all);
        self.turning.begin(all);
    }

    /// The solutions.
    pub fn solutions(&mut self) -> [&mut Solution; 3] {
        [&mut self.slow, &mut self.fast.solution, &mut self.turning.solution]
    }

    /// The laser may have crept for so long, m or times two seconds.
    pub fn creep(&mut self, lasted: f64) {
        for (solution, (place, yaw)) in self.solutions().into_iter().zip([SLOW, FAST, TURNING]) {
            solution.loosen_mounting(place * place * lasted, yaw * yaw * lasted);
        }
    }

    /// Takes what landmarks say; `all` has taken it.
    pub fn correct(&mut self, told: &SensorInformation, laser: &Laser, all: &Solution) {
        self.slow.correct(told, laser);
        self.fast.correct(told, laser, all);
        self.turning.correct(told, laser, all);
    }

    /// Adds their bounds of a pose; see [`Solution::bound`]. A fast creep counts once it is found, or `is_doubted` says that the
    /// laser moves.
    pub fn add_to(
        &self,
        envelope: &mut Envelope,
        pose: &Pose,
        surprise: f64,
        map_variances: (f64, f64),
        is_doubted: bool,
    ) {
        let mut add = |solution: &Solution, factors: &Factors| {
            envelope.add(&solution.bound(pose, &factors.times(surprise), map_variances));
        };
        add(&self.slow, &ONE_FAULT);
        add(&self.turning.solution, if self.turning.is_found { &ONE_FAULT } else { &ONE_RARE_FAULT });
        if self.fast.is_found || is_doubted {
            add(&self.fast.solution, &ONE_FAULT);
        }
    }
}

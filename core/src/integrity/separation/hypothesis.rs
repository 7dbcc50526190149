//! What may be wrong, each with the solution that holds if it is.

use heapless::Vec;
use serde::{Deserialize, Serialize};

use super::assumed::Factors;
use super::envelope::{Envelope, SolutionBound};
use super::sensor_information::SensorInformation;
use super::solution::{FREE_POSITION, FREE_YAW, Laser, Solution};
use crate::geometry::Pose;
use crate::measurement::Time;
use crate::state::ProtectionLevel;

/// Landmarks that one solution leaves out.
pub const TOGETHER: usize = 8;

/// What is left out together: each reflector alone, all natural features, which one map and one detector tell, and all contours.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum LandmarkKey {
    /// A reflector of the fixed map.
    Reflector(u16),
    /// All natural features.
    Features,
    /// All contours.
    Contours,
}

/// Some landmarks are not where the map has them: a solution that has not used them since they came in sight.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct LeftOut {
    /// Which.
    pub keys: Vec<LandmarkKey, TOGETHER>,
    /// What they tell in the present event.
    pub told: SensorInformation,
    /// Distance since one of them was seen, m.
    pub unseen: f64,
    /// The solution without them.
    pub solution: Solution,
}

/// The laser was knocked, or the vehicle was carried or has slid, in an interval: its mounting is free then, and stays as it
/// is found.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Knock {
    /// When the interval began.
    pub from: Time,
    /// Whether the interval has ended.
    pub is_over: bool,
    /// The solution.
    pub solution: Solution,
}

/// Something was not as believed before a time: it is free then, and nothing that was known is used.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct FreeSince {
    /// That time.
    pub since: Time,
    /// Turned while landmarks were in sight, rad.
    pub turned: f64,
    /// Driven while landmarks were in sight, m.
    pub driven: f64,
    /// Whether what was known before does not hold, so that its bound counts before it has found anything.
    pub is_needed: bool,
    /// How well it fits.
    pub fit: Fit,
    /// Whether the place of the laser is free and the heading has not been found yet.
    pub awaits_heading: bool,
    /// While the heading has not been found, the next event is taken once so much was driven and turned, m and rad together.
    pub next: f64,
    /// Whether the last event refuted it, which was not taken then.
    pub is_surprised: bool,
    /// The solution.
    pub solution: Solution,
}

/// How well a solution has fitted lately.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub struct Fit {
    /// Mean of the normalised squared innovations of some events; 3 is expected at most.
    mean: f64,
}

/// Events over which the fit is averaged.
const EVENTS: f64 = 32.0;
/// A solution whose normalised squared innovation, of three degrees of freedom, is larger does not hold: a right one is
/// refused once in 1e8 events.
const REFUTED: f64 = 40.0;
/// The same of the mean: the sum over 32 events exceeds 32 times this less than once in 1e9 times.
const REFUTED_LATELY: f64 = 6.5;

/// Whether a solution does not hold; one that is not a number does not.
#[must_use]
pub fn is_refuted(normalised_square: f64) -> bool {
    normalised_square.is_nan() || normalised_square > REFUTED
}

impl Fit {
    /// Takes one event; true if the solution does not hold.
    pub fn refutes(&mut self, normalised_square: f64) -> bool {
        self.mean += (normalised_square.min(REFUTED) - self.mean) / EVENTS;
        is_refuted(normalised_square) || self.mean > REFUTED_LATELY
    }
}

/// What a turn shows of the place of the laser, and a drive of its yaw, is enough from here on, rad and m.
const ENOUGH: (f64, f64) = (core::f64::consts::FRAC_PI_2, 5.0);
/// While the heading is hardly known, events tell something new after this motion only, m and rad together.
const APART: f64 = 0.1;
/// A pose is well known if it has no larger deviations than these, m and rad.
const WELL_KNOWN: (f64, f64) = (0.007, 1.4e-3);

impl FreeSince {
    /// Begins at `since`.
    #[must_use]
    pub const fn new(since: Time, solution: Solution) -> Self {
        Self {
            since,
            turned: 0.0,
            driven: 0.0,
            is_needed: false,
            fit: Fit { mean: 0.0 },
            awaits_heading: false,
            next: 0.0,
            is_surprised: false,
            solution,
        }
    }

    /// Takes what landmarks say; true if the solution does not hold. One event alone that refutes it may have seen something else than
    /// landmarks: it is not taken, and only the next one decides. While the heading was hardly known, the arm to the laser pointed
    /// elsewhere in each step, which looks like a turn and tells a place of the laser that nothing has shown: what was learned of
    /// places until then is forgotten. A vehicle that stands would learn its heading from that alone, so events are taken apart.
    pub fn correct(&mut self, told: &SensorInformation, laser: &Laser) -> bool {
        let moved = self.driven + self.turned;
        if self.awaits_heading && moved < self.next {
            return false;
        }
        self.next = moved + APART;
        let before = self.solution.clone();
        let square = self.solution.correct(told, laser);
        let was_surprised = core::mem::replace(&mut self.is_surprised, is_refuted(square));
        if self.is_surprised && !was_surprised {
            self.solution = before;
            return false;
        }
        if self.awaits_heading && self.solution.is_heading_sure() {
            self.awaits_heading = false;
            self.solution.forget_places();
            // Only what follows shows them.
            (self.turned, self.driven) = (0.0, 0.0);
        }
        self.fit.refutes(square)
    }

    /// Whether a free place and yaw of the laser have been found: while the heading is hardly known, no turn shows the place.
    #[must_use]
    pub fn has_found_mounting(&self) -> bool {
        !self.awaits_heading && self.turned >= ENOUGH.0 && self.has_found_yaw()
    }

    /// Whether it knows its pose well, mounting and all.
    #[must_use]
    pub fn is_well_known(&self) -> bool {
        let (position, heading) = self.solution.variances();
        position <= WELL_KNOWN.0 * WELL_KNOWN.0 && heading <= WELL_KNOWN.1 * WELL_KNOWN.1
    }

    /// Whether its bound counts: it is needed, or refuted for the moment, or it has found the place of the laser, or knows its pose well without.
    #[must_use]
    pub fn counts(&self) -> bool {
        self.is_needed || self.is_surprised || self.has_found_mounting() || self.is_well_known()
    }

    /// Adds how far a pose may be off if this solution is right; see [`Solution::bound`]. What is said of places while the heading was hardly
    /// known does not count, and until the next event nothing does if the last one has refuted it.
    pub fn add_to(&self, envelope: &mut Envelope, pose: &Pose, factors: &Factors, map_variances: (f64, f64)) {
        let position = if self.awaits_heading || self.is_surprised { factors.position * FREE_POSITION } else { 0.0 };
        let heading = if self.is_surprised { factors.heading * FREE_YAW } else { 0.0 };
        envelope.add(&SolutionBound::fixed(&ProtectionLevel { position, heading }));
        envelope.add(&self.solution.bound(pose, factors, map_variances));
    }

    /// Whether a free yaw of the laser has been found.
    #[must_use]
    pub fn has_found_yaw(&self) -> bool {
        self.driven >= ENOUGH.1
    }
}

//! What the corrections by landmarks say of the odometry and of the laser's mounting.
//!
//! Where everything is as it is believed, corrections are small and have no common direction. A laser that looks askew makes
//! the vehicle seem to drive askew: each metre needs the same correction to the side. One that stands elsewhere needs it in
//! each turn. A wheel of another size needs it along the way, a bent steering in the heading. So the corrections, taken as
//! linear in the way and the turn between two of them, tell which is wrong:
//! side = askew way + lever turn, along = scale way + lever turn, heading = bend way + gain turn.

use nalgebra::{Matrix2, Vector2};

use crate::geometry::Pose;

/// What is remembered of the way and the turn: this much, m and rad, counts by 1/e.
const MEMORY: (f64, f64) = (4.0, 1.5);
/// Corrections are summed over about this many revolutions.
const TREND: f64 = 8.0;
/// Way, m, and turn, rad, that a verdict needs within the memory.
const LEAST_WAY: f64 = 1.5;
const LEAST_TURN: f64 = 0.6;
/// The laser looks askew by more than this, rad, or stands elsewhere by more than this, m.
const ASKEW: f64 = 0.009;
const ELSEWHERE: f64 = 0.06;
/// It is as it is believed again if both are below this share of the limits.
const HEALED: f64 = 0.6;
/// A way, share of itself, and a turn, rad a metre, that the odometry cannot be wrong by.
const SCALE: f64 = 0.03;
const BEND: f64 = 0.01;

/// Way after which the heading has been corrected, m.
const BEND_LAG: f64 = 0.5;

/// Which of the two is wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Suspect {
    /// The odometry: its scale or its steering.
    Odometry,
    /// The laser: it looks askew or stands elsewhere.
    Laser,
}

/// Sums over the corrections, with exponential forgetting.
#[derive(Clone, Debug)]
pub struct DriftCheck {
    information: Matrix2<f64>,
    along: Vector2<f64>,
    side: Vector2<f64>,
    heading: Vector2<f64>,
    way: f64,
    turn: f64,
    trend: Vector2<f64>,
    heading_trend: f64,
    is_laser_suspected: bool,
}

impl DriftCheck {
    /// A check that has seen nothing.
    #[must_use]
    pub fn new() -> Self {
        Self {
            information: Matrix2::zeros(),
            along: Vector2::zeros(),
            side: Vector2::zeros(),
            heading: Vector2::zeros(),
            way: 0.0,
            turn: 0.0,
            trend: Vector2::zeros(),
            heading_trend: 0.0,
            is_laser_suspected: false,
        }
    }

    /// Forgets the corrections, as those that a new pose needs say nothing of the vehicle. A suspicion remains.
    pub fn restart(&mut self) {
        *self = Self { is_laser_suspected: self.is_laser_suspected, ..Self::new() };
    }

    /// The laser has moved: it is to be suspected until the vehicle has driven and turned without a contradiction.
    pub fn suspect_laser(&mut self) {
        self.is_laser_suspected = true;
    }

    /// Takes one revolution: the motion since the last one by odometry, and the correction in R after it.
    pub fn add(&mut self, motion: &Pose, correction: &Pose) {
        let (way, turn) = (motion.x, motion.theta);
        let remaining = libm::exp(-libm::fabs(way) / MEMORY.0 - libm::fabs(turn) / MEMORY.1);
        let input = Vector2::new(way, turn);
        self.information = self.information * remaining + input * input.transpose();
        self.along = self.along * remaining + input * correction.x;
        self.side = self.side * remaining + input * correction.y;
        self.heading = self.heading * remaining + input * correction.theta;
        self.way = self.way * remaining + libm::fabs(way);
        self.turn = self.turn * remaining + libm::fabs(turn);
        self.trend = self.trend * (1.0 - 1.0 / TREND) + Vector2::new(correction.x, correction.y);
        self.heading_trend = self.heading_trend * (1.0 - 1.0 / TREND) + correction.theta;
        self.is_laser_suspected = self.judge_laser().unwrap_or(self.is_laser_suspected);
    }

    /// By how much landmarks have lately corrected the pose in one direction, m and rad: what the filter lags behind by.
    #[must_use]
    pub fn trend(&self) -> [f64; 2] {
        [self.trend.norm(), libm::fabs(self.heading_trend)]
    }

    /// What each metre and each radian add to the correction; of either only if there were enough.
    fn solve(&self, sum: &Vector2<f64>) -> (Option<f64>, Option<f64>) {
        let (has_way, has_turn) = (self.way >= LEAST_WAY, self.turn >= LEAST_TURN);
        let mut information = self.information;
        // What has not been driven is held at zero by a little information of its own.
        information.m11 += FLOOR.0;
        information.m22 += FLOOR.1;
        let determinant = information.m11 * information.m22 - information.m12 * information.m12;
        let a = (information.m22 * sum.x - information.m12 * sum.y) / determinant;
        let b = (information.m11 * sum.y - information.m12 * sum.x) / determinant;
        (has_way.then_some(a), has_turn.then_some(b))
    }

    /// Whether the laser is suspected; none if there is no evidence either way.
    fn judge_laser(&self) -> Option<bool> {
        let (askew, forward) = self.solve(&self.side);
        let (_, sideward) = self.solve(&self.along);
        // Before the heading is corrected, a bent steering leads the vehicle aside, too.
        let (bend, _) = self.solve(&self.heading);
        let askew = askew.map(|askew| (libm::fabs(askew) - BEND_LAG * libm::fabs(bend.unwrap_or(0.0))).max(0.0));
        let is_beyond = |value: Option<f64>, limit: f64| value.is_some_and(|value| libm::fabs(value) > limit);
        let is_below = |value: Option<f64>, limit: f64| value.is_some_and(|value| libm::fabs(value) < HEALED * limit);
        if is_beyond(askew, ASKEW) || is_beyond(forward, ELSEWHERE) || is_beyond(sideward, ELSEWHERE) {
            return Some(true);
        }
        let is_well = is_below(askew, ASKEW) && is_below(forward, ELSEWHERE) && is_below(sideward, ELSEWHERE);
        is_well.then_some(false)
    }

    /// Which of the two is wrong, if one is.
    #[must_use]
    pub fn suspect(&self) -> Option<Suspect> {
        if self.is_laser_suspected {
            return Some(Suspect::Laser);
        }
        let (scale, _) = self.solve(&self.along);
        let (bend, _) = self.solve(&self.heading);
        let is_beyond = |value: Option<f64>, limit: f64| value.is_some_and(|value| libm::fabs(value) > limit);
        (is_beyond(scale, SCALE) || is_beyond(bend, BEND)).then_some(Suspect::Odometry)
    }

    /// What it has found, for whoever wants to look: askew (rad), forward, sideward (m), scale (share), bend (rad/m).
    #[must_use]
    pub fn findings(&self) -> [Option<f64>; 5] {
        let (askew, forward) = self.solve(&self.side);
        let (scale, sideward) = self.solve(&self.along);
        let (bend, _) = self.solve(&self.heading);
        [askew, forward, sideward, scale, bend]
    }
}

/// Information, m^2 and rad^2.
const FLOOR: (f64, f64) = (0.01, 0.003);

impl Default for DriftCheck {
    fn default() -> Self {
        Self::new()
    }
}

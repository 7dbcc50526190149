//! What the corrections by landmarks say of the odometry and of the laser's mounting.
//!
//! Where everything is as it is believed, corrections are small and have no common direction. A laser with a yaw error makes
//! the vehicle seem to drive to one side: each metre needs the same correction across. One with a lever arm error needs it in each
//! turn. A wheel of another size needs it along the distance, a bent steering in the heading. So the corrections, taken as
//! linear in the distance and the turn between two of them, tell which is wrong:
//! side = yaw distance + lever turn, along = scale distance + lever turn, heading = bend distance + gain turn.

use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

use crate::geometry::Pose;

/// What is remembered of the distance and the turn: this much, m and rad, counts by 1/e.
const MEMORY: (f64, f64) = (2.5, 1.5);
/// Distance, m, and turn, rad, within the memory that the first verdict against the laser or the odometry needs.
const LEAST: (f64, f64) = (0.3, 0.3);
/// Distance, m, and turn, rad, without a contradiction after which the laser is as it is believed again, however fast the memory
/// fades on them.
const HEALING: (f32, f32) = (1.2, 0.45);
/// Turn, rad, without a contradiction after which it does not matter that a wide bend leaves less than that in the memory:
/// what would contradict has come through the lag of the filter by then.
const SETTLED: f32 = 1.35;
/// What noise adds up to over any distance and turn: it must not be taken for a drift of a short one. m to the side and along,
/// rad.
const NOISE: (f64, f64) = (0.012, 0.01);
/// Yaw error, rad, and lever arm error, m, from which on the laser is suspected.
const YAW_ERROR: f64 = 0.006;
const LEVER_ERROR: f64 = 0.06;
/// It is as it is believed again if both are below this share of the limits.
const HEALED: f64 = 0.9;
/// A distance, share of itself, and a turn, rad a metre, that the odometry cannot be wrong by.
const SCALE: f64 = 0.03;
const BEND: f64 = 0.01;

/// Distance after which the heading has been corrected, m.
const BEND_LAG: f64 = 0.5;

/// Which of the two is wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Suspect {
    /// The odometry: its scale or its steering.
    Odometry,
    /// The laser: a yaw error or a lever arm error.
    Laser,
}

/// Sums over the corrections, with exponential forgetting.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct MountingCheck {
    /// Of the distance, of both, of the turn.
    information: [f64; 3],
    along: Vector2<f64>,
    side: Vector2<f64>,
    heading: Vector2<f64>,
    distance: f64,
    turn: f64,
    suspect: Option<Suspect>,
    /// Distance, m, and turn, rad, since the laser was last contradicted.
    sound: (f32, f32),
}

/// What each metre and each radian add to a correction; none of what was not driven enough.
#[derive(Clone, Copy)]
struct Rates {
    distance: Option<f64>,
    turn: Option<f64>,
}

fn is_beyond(rate: Option<f64>, limit: f64) -> bool {
    rate.is_some_and(|rate| libm::fabs(rate) > limit)
}

fn is_below(rate: Option<f64>, limit: f64) -> bool {
    rate.is_some_and(|rate| libm::fabs(rate) < HEALED * limit)
}

impl MountingCheck {
    /// A check that has seen nothing.
    #[must_use]
    pub fn new() -> Self {
        Self {
            information: [0.0; 3],
            along: Vector2::zeros(),
            side: Vector2::zeros(),
            heading: Vector2::zeros(),
            distance: 0.0,
            turn: 0.0,
            suspect: None,
            sound: (0.0, 0.0),
        }
    }

    /// Forgets the corrections, as those that a new pose needs say nothing of the vehicle. A suspicion of the laser
    /// remains.
    pub fn restart(&mut self) {
        *self = Self { suspect: self.suspect.filter(|suspect| *suspect == Suspect::Laser), ..Self::new() };
    }

    /// The laser has moved: it is to be suspected until the vehicle has driven and turned without a contradiction.
    pub fn suspect_laser(&mut self) {
        self.suspect = Some(Suspect::Laser);
        self.sound = (0.0, 0.0);
    }

    /// Takes one revolution: the motion since the last one by odometry, and the correction in R after it.
    pub fn add(&mut self, motion: &Pose, correction: &Pose) {
        let (distance, turn) = (motion.x, motion.theta);
        let remaining = libm::exp(-libm::fabs(distance) / MEMORY.0 - libm::fabs(turn) / MEMORY.1);
        let input = Vector2::new(distance, turn);
        let [of_way, of_both, of_turn] = self.information.map(|information| information * remaining);
        self.information = [of_way + distance * distance, of_both + distance * turn, of_turn + turn * turn];
        self.along = self.along * remaining + input * correction.x;
        self.side = self.side * remaining + input * correction.y;
        self.heading = self.heading * remaining + input * correction.theta;
        self.distance = self.distance * remaining + libm::fabs(distance);
        self.turn = self.turn * remaining + libm::fabs(turn);
        self.sound.0 += libm::fabs(distance) as f32;
        self.sound.1 += libm::fabs(turn) as f32;
        self.suspect = self.judge();
    }

    /// Which of the two is wrong, if one is.
    #[must_use]
    pub fn suspect(&self) -> Option<Suspect> {
        self.suspect
    }

    fn judge(&mut self) -> Option<Suspect> {
        let (has_way, has_turn) = (self.distance >= LEAST.0, self.turn >= LEAST.1);
        if !has_way && !has_turn {
            return self.suspect;
        }
        // What has not been driven is held at zero by a little information of its own.
        let [of_way, m12, of_turn] = self.information;
        let (m11, m22) = (of_way + FLOOR.0, of_turn + FLOOR.1);
        let share = 1.0 / (m11 * m22 - m12 * m12);
        let rates = |sum: &Vector2<f64>| Rates {
            distance: has_way.then(|| (m22 * sum.x - m12 * sum.y) * share),
            turn: has_turn.then(|| (m11 * sum.y - m12 * sum.x) * share),
        };
        let (along, side, heading) = (rates(&self.along), rates(&self.side), rates(&self.heading));
        // Before the heading is corrected, a bent steering leads the vehicle aside, too.
        let bend = libm::fabs(heading.distance.unwrap_or(0.0));
        let yaw_error = side.distance.map(|yaw| (libm::fabs(yaw) - BEND_LAG * bend).max(0.0));
        let (distance_noise, turn_noise) = (NOISE.0 / self.distance.max(LEAST.0), NOISE.0 / self.turn.max(LEAST.1));
        let lever_error = LEVER_ERROR + turn_noise;
        let laser = [(yaw_error, YAW_ERROR + distance_noise), (side.turn, lever_error), (along.turn, lever_error)];
        // What was not driven enough within the memory contradicts nothing, and shows nothing.
        if !laser.iter().all(|(rate, limit)| rate.is_none() || is_below(*rate, *limit)) {
            self.sound = (0.0, 0.0);
        }
        let has_turned = self.turn >= f64::from(HEALING.1) || self.sound.1 >= SETTLED;
        let has_driven = has_way && has_turn && has_turned && self.sound.0 >= HEALING.0 && self.sound.1 >= HEALING.1;
        let is_healed = has_driven || self.suspect != Some(Suspect::Laser);
        if laser.iter().any(|(rate, limit)| is_beyond(*rate, *limit)) || !is_healed {
            return Some(Suspect::Laser);
        }
        let bend_noise = NOISE.1 / self.distance.max(LEAST.0);
        (is_beyond(along.distance, SCALE + distance_noise) || is_beyond(heading.distance, BEND + bend_noise))
            .then_some(Suspect::Odometry)
    }
}

/// Information, m^2 and rad^2.
const FLOOR: (f64, f64) = (0.01, 0.003);

impl Default for MountingCheck {
    fn default() -> Self {
        Self::new()
    }
}

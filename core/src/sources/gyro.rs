//! A rate gyro: it tells the turn of each motion, and while the vehicle stands it tells its bias.
//!
//! The turn that the wheels tell is replaced, not averaged: their walk of the heading is some ten times that of a gyro, and what
//! lasts of their errors is not independent from motion to motion.

use serde::{Deserialize, Serialize};

use crate::filter::{GyroState, KnownPose};
use crate::measurement::GyroSample;
use crate::odometry::{GyroErrors, GyroParameters, GyroRefusal, GyroTurn, GyroTurns, Motion, StandingWheels};

/// Normalised squared innovation of a rate at rest that is not believed: five deviations.
const REST_GATE: f64 = 25.0;
/// For so long, s, one rate after the other must be none of a vehicle at rest before the bias has jumped.
const JUMPED_AFTER: f64 = 0.5;
/// A bias does not jump by more than so many of its deviations: the vehicle turns, though its wheels stand.
const LARGEST_JUMP: f64 = 3.0;

/// What a reading at rest has shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AtRest {
    /// The vehicle does not stand.
    No,
    /// The bias, as it was believed.
    Believed,
    /// Something else, for a moment.
    Doubtful,
    /// The bias is another one.
    Jumped,
    /// The vehicle turns, though its wheels stand.
    Turns,
}

/// The bias as it was seen at rest since somebody asked.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RestSum {
    sum: f64,
    weight: f64,
}

impl RestSum {
    /// Mean rate, rad/s, and its variance; none if nothing was seen.
    #[must_use]
    pub fn mean(&self) -> Option<(f64, f64)> {
        (self.weight > 0.0).then(|| (self.sum / self.weight, 1.0 / self.weight))
    }
}

/// A gyro with what is known of it.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct GyroSource {
    parameters: GyroParameters,
    turns: GyroTurns,
    state: GyroState,
    wheels: StandingWheels,
    /// For how long the rates at rest were not believed, s.
    doubted: f64,
    turns_at_rest: bool,
    seen_at_rest: RestSum,
}

/// A motion whose turn the gyro has told.
#[derive(Clone, Copy, Debug)]
pub struct GyroMotion {
    /// The motion, with the variance of its turn by the noise of the gyro alone.
    pub motion: Motion,
    /// What the gyro has told of it.
    pub turn: GyroTurn,
}

/// Why a gyro tells no turn of a motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoTurn {
    /// It has not told all of it.
    Silent,
    /// The vehicle stands, and so does not turn.
    Standing,
}

impl GyroSource {
    /// A gyro that has said nothing.
    #[must_use]
    pub fn new(parameters: &GyroParameters) -> Self {
        Self {
            parameters: *parameters,
            turns: GyroTurns::new(parameters),
            state: GyroState::new(parameters),
            wheels: StandingWheels::new(),
            doubted: 0.0,
            turns_at_rest: false,
            seen_at_rest: RestSum::default(),
        }
    }

    /// What is known of its errors.
    #[must_use]
    pub const fn state(&self) -> &GyroState {
        &self.state
    }

    /// See [`GyroTurns::is_after_gap`].
    #[must_use]
    pub const fn is_after_gap(&self) -> bool {
        self.turns.is_after_gap()
    }

    /// The last rate without the bias, rad/s.
    #[must_use]
    pub fn rate(&self) -> f64 {
        self.turns.rate() - self.state.errors().bias
    }

    /// The pose begins anew.
    pub fn begin_pose(&mut self) {
        self.state.begin_pose();
    }

    /// Forgets what it has told, as it is not believed: its next turn begins with the reading that follows.
    pub fn forget(&mut self) {
        self.turns.restart();
    }

    /// Takes a reading.
    ///
    /// # Errors
    /// See [`GyroRefusal`].
    pub fn sample(&mut self, sample: &GyroSample) -> Result<AtRest, GyroRefusal> {
        let (rate, passed) = self.turns.sample(sample)?;
        let Some(passed) = passed.filter(|_| self.wheels.stands()) else {
            (self.doubted, self.turns_at_rest) = (0.0, false);
            return Ok(AtRest::No);
        };
        let variance = self.parameters.noise * self.parameters.noise / passed;
        if self.state.test_rest(rate, variance) <= REST_GATE {
            (self.doubted, self.turns_at_rest) = (0.0, false);
            self.state.see_rest(rate, variance);
            self.seen_at_rest.sum += rate / variance;
            self.seen_at_rest.weight += 1.0 / variance;
            return Ok(AtRest::Believed);
        }
        self.doubted += passed;
        self.turns_at_rest = libm::fabs(rate) > LARGEST_JUMP * self.parameters.bias;
        if self.turns_at_rest {
            return Ok(AtRest::Turns);
        }
        if self.doubted < JUMPED_AFTER {
            return Ok(AtRest::Doubtful);
        }
        self.doubted = 0.0;
        self.state.begin_bias(rate);
        self.seen_at_rest = RestSum::default();
        Ok(AtRest::Jumped)
    }

    /// Takes a motion of the wheels, and tells it with the turn of the gyro.
    ///
    /// # Errors
    /// See [`NoTurn`].
    pub fn travel(&mut self, motion: &Motion) -> Result<GyroMotion, NoTurn> {
        let stands = self.wheels.add(motion);
        let turn = self.turns.turn(motion.start, motion.end).ok_or(NoTurn::Silent)?;
        if stands && !self.turns_at_rest {
            return Err(NoTurn::Standing);
        }
        Ok(GyroMotion { motion: motion.with_turn(turn.corrected(self.state.errors()), turn.variance), turn })
    }

    /// The turn of a motion of which the wheels have told nothing: nobody knows whether the vehicle stands.
    pub fn coast(&mut self, motion: &Motion) -> Option<GyroMotion> {
        self.wheels.forget();
        let turn = self.turns.turn(motion.start, motion.end)?;
        Some(GyroMotion { motion: motion.with_turn(turn.corrected(self.state.errors()), turn.variance), turn })
    }

    /// A motion that is assumed until the wheels report what it was, with the turn that the gyro has told, if it has told it.
    #[must_use]
    pub fn turn_assumed(&self, motion: &Motion) -> Motion {
        let Some(turn) = self.turns.turn_between(motion.start, motion.end) else { return *motion };
        let bias = self.state.deviations().0 * turn.duration;
        motion.with_turn(turn.corrected(self.state.errors()), turn.variance + bias * bias)
    }

    /// Lets the errors go on with a motion from a heading in W, rad, whose turn the gyro has told, if it has. Returns the motion
    /// with what the errors add to its covariance.
    #[must_use]
    pub fn go_on(&mut self, heading: f64, motion: &Motion, turn: Option<&GyroTurn>) -> Motion {
        let duration = motion.end.since(motion.start);
        let added = self.state.predict(heading, &motion.displacement, duration, turn);
        Motion { covariance: motion.covariance + added, ..*motion }
    }

    /// The pose of now was corrected; returns by how much that has changed what is believed of the errors.
    pub fn correct(&mut self, before: &KnownPose, after: &KnownPose) -> GyroErrors {
        let GyroErrors { bias, scale } = *self.state.errors();
        self.state.correct(before, after);
        let now = self.state.errors();
        GyroErrors { bias: now.bias - bias, scale: now.scale - scale }
    }

    /// What was seen at rest since the last call.
    pub fn take_rest(&mut self) -> RestSum {
        core::mem::take(&mut self.seen_at_rest)
    }
}

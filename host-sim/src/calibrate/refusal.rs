//! Why a drive gives no parameters, in words.

use agv_core::calibration::Unobservable;
use thiserror::Error;

use super::joint::FitError;

/// Why there is no result.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum Refusal {
    /// The vehicle is no tricycle.
    #[error("the log is not of a tricycle with encoders")]
    OtherVehicle,
    /// There are no samples of encoders.
    #[error("the log holds no samples of the encoders")]
    NoEncoders,
    /// The driving wheel has not moved.
    #[error("the driving wheel does not move in this log")]
    NoMotion,
    /// A counter counts the wrong way.
    #[error("{0}; it can be mended")]
    WrongDirection(String),
    /// Nothing says how the laser moved.
    #[error("nothing in the log says how the laser moved: there are neither reflectors nor poses of it")]
    NoLaserMotion,
    /// Reflectors were not numbers.
    #[error("the reflectors of the log are no numbers: {0} of them, and none that is one")]
    NoNumbers(usize),
    /// The reflectors contradict each other.
    #[error(
        "the reflectors do not agree on a motion in {bad} of {all} segments: they were moved, or others were taken for them"
    )]
    ReflectorsMoved {
        /// Segments in which they do not agree.
        bad: usize,
        /// All segments.
        all: usize,
    },
    /// There were too few reflectors.
    #[error("too few reflectors were seen from both ends in {bad} of {all} segments")]
    FewReflectors {
        /// Segments with too few.
        bad: usize,
        /// All segments.
        all: usize,
    },
    /// There are too few segments.
    #[error("{needed} segments with motion are needed; found: {found}")]
    TooFewSegments {
        /// What there is.
        found: usize,
        /// What is needed.
        needed: usize,
    },
    /// The closed forms have no solution.
    #[error("{}", words(*.0))]
    Unobservable(Unobservable),
    /// The nonlinear fit has none.
    #[error(transparent)]
    Fit(FitError),
    /// The segments contradict each other.
    #[error(
        "{bad} of {all} segments contradict the others, first at {first:.1} s: the wheel slips, or the laser's motion is wrong"
    )]
    Contradiction {
        /// Segments that contradict.
        bad: usize,
        /// All segments.
        all: usize,
        /// Begin of the first of them, s.
        first: f64,
    },
    /// What the wheel says and what the laser says differ by more than a wheel that rolls.
    #[error(
        "encoders and laser differ by {slip_percent:.2} % of a metre's way and {steering_deg:.2} deg of steering: the wheel slips, or an encoder is wrong"
    )]
    Slip {
        /// Slip over a metre, per cent of it.
        slip_percent: f64,
        /// Deviation of the steering angle.
        steering_deg: f64,
    },
    /// A parameter is known so badly that the result is of no use.
    #[error("the drive does not tell the {parameter}: its standard deviation would be {deviation}")]
    Uncertain {
        /// Which.
        parameter: &'static str,
        /// With its unit.
        deviation: String,
    },
}

impl From<Unobservable> for Refusal {
    fn from(reason: Unobservable) -> Self {
        Self::Unobservable(reason)
    }
}

impl From<FitError> for Refusal {
    fn from(reason: FitError) -> Self {
        Self::Fit(reason)
    }
}

/// What the core's short reason means.
#[must_use]
pub fn words(reason: Unobservable) -> &'static str {
    match reason {
        Unobservable::TooFewSegments => "there are too few segments",
        Unobservable::NoMotion => "the driving wheel hardly moves",
        Unobservable::NotFinite => "a value is not a number",
        Unobservable::OneSteeringAngle => "only one steering angle: the offset cannot be told from the scale",
        Unobservable::OneSteeringAngleForward => {
            "only one steering angle forward: the forward offset cannot be told from the scale"
        }
        Unobservable::OneSteeringAngleBackward => {
            "only one steering angle backward: the backward offset cannot be told from the scale"
        }
        Unobservable::NoRotation => "the vehicle hardly turns: the place of the laser cannot be told",
        Unobservable::NoTranslation => "the laser hardly moves: its heading cannot be told",
        Unobservable::NoCommonScale => "the rotations forward and backward allow no common drive scale",
        Unobservable::WrongSide => "the laser seems to be on the other side of the axle than stated",
    }
}

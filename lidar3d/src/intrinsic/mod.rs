//! Intrinsic calibration from scans of planes (M chapter 3).

mod plane;
mod solve;

pub use plane::{Plane, fit};
pub use solve::{Outcome, Return, SolveError, Uncertainty, solve};

//! Observations with a model of their own.

use crate::filter::{Ekf, Linearisation, Slots};
use crate::maps::Verdict;
use crate::measurement::Time;

/// Something that says `SIZE` numbers of the state, by a model that it brings itself: the distance to a wall, the rate of a
/// gyroscope, a position by radio.
pub trait Aid<const SIZE: usize> {
    /// When it was true.
    fn time(&self) -> Time;

    /// Compares what was observed with what is expected of a state; none if nothing can be expected. States 0 to 2 are x, y
    /// (m) and heading (rad) of R in W.
    fn linearise<S: Slots>(&self, state: &Ekf<S>) -> Option<Linearisation<SIZE>>;

    /// Largest squared Mahalanobis distance that is believed: chi-square with `SIZE` degrees of freedom.
    fn gate(&self) -> f64;
}

/// What became of an aid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AidOutcome {
    /// Accepted if it has corrected the pose.
    pub verdict: Verdict,
    /// Squared Mahalanobis distance over the gate; none if nothing was compared.
    pub test_ratio: Option<f64>,
}

impl AidOutcome {
    /// The filter was not asked.
    pub(crate) const OUT_OF_TIME: Self = Self { verdict: Verdict::OutOfTime, test_ratio: None };
}

/// Corrects a filter by an aid.
pub(crate) fn correct<const SIZE: usize, S: Slots>(filter: &mut Ekf<S>, aid: &impl Aid<SIZE>) -> AidOutcome {
    let Some(linearisation) = aid.linearise(filter) else {
        return AidOutcome { verdict: Verdict::Unknown, test_ratio: None };
    };
    let covariance = filter.residual_covariance(&linearisation);
    let square = covariance.cholesky().map(|root| linearisation.residual.dot(&root.solve(&linearisation.residual)));
    let Some(test_ratio) = square.map(|square| square / aid.gate()).filter(|ratio| ratio.is_finite()) else {
        return AidOutcome { verdict: Verdict::Unknown, test_ratio: None };
    };
    let is_used = test_ratio <= 1.0 && filter.correct(&linearisation);
    AidOutcome { verdict: if is_used { Verdict::Accepted } else { Verdict::Gated }, test_ratio: Some(test_ratio) }
}

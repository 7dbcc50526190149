//! How wrong a pose may be.

use crate::state::PoseOutput;

/// Bounds that the errors of a pose exceed with a small probability (the protection levels of satellite navigation,
/// RTCA DO-229, appendix J).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProtectionLevel {
    /// Of the position, m.
    pub position: f64,
    /// Of the heading, rad.
    pub heading: f64,
}

/// Deviations in the bound of the position: a distance in the plane exceeds them with half of the risk,
/// exp(-k^2 / 2) = risk / 2.
const POSITION_FACTOR: f64 = 5.80;
/// Deviations in the bound of the heading: a normal number exceeds them with half of the risk, on either side.
const HEADING_FACTOR: f64 = 5.45;
/// What calibration, survey and clocks may be wrong by without that any check tells it soon, m and rad.
const POSITION_ALLOWANCE: f64 = 0.060;
const HEADING_ALLOWANCE: f64 = 0.0175;
/// The filter lags behind a steady drift by at most so many times what it corrects in its trend.
const LAG: f64 = 0.3;

impl ProtectionLevel {
    /// Probability that one of the bounds is exceeded although nothing is wrong with vehicle, sensors and map.
    pub const RISK: f64 = 1e-7;

    /// How wrong a pose may be: from its covariance, made larger by as much as the innovations are larger
    /// than expected, from the trend of the corrections, and from what no check tells soon.
    #[must_use]
    pub fn of(output: &PoseOutput) -> Self {
        let [xx, xy, yy, _, _, heading] = output.covariance;
        let worst = 0.5 * (xx + yy) + libm::hypot(0.5 * (xx - yy), xy);
        let [drift, heading_drift] = output.drift;
        let surprise = libm::sqrt((0.5 * output.normalised_square).max(1.0));
        Self {
            position: POSITION_FACTOR * surprise * libm::sqrt(worst) + LAG * drift + POSITION_ALLOWANCE,
            heading: HEADING_FACTOR * surprise * libm::sqrt(heading) + LAG * heading_drift + HEADING_ALLOWANCE,
        }
    }
}

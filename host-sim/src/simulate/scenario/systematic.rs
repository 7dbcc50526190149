//! Errors of a laser that are the same in each revolution.

use serde::{Deserialize, Serialize};

/// Errors of ranges and bearings that do not change. A bearing is told wrong by harmonics of the direction: the first one of a disc that
/// turns about a point beside its middle, the second one of an oval one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SystematicErrors {
    /// What each range is too long, m.
    pub range_bias: f64,
    /// The same as a share of the range.
    pub range_scale: f64,
    /// What the range of a flat reflector is too long that is seen from its edge, m; less by the cosine of the angle of incidence from
    /// nearer to its front.
    pub incidence: f64,
    /// Largest error by the first harmonic.
    pub first_harmonic_deg: f64,
    /// Direction in S at which that error begins to grow.
    pub first_phase_deg: f64,
    /// Largest error by the second harmonic.
    pub second_harmonic_deg: f64,
    /// Direction in S at which that error begins to grow.
    pub second_phase_deg: f64,
}

impl SystematicErrors {
    /// What is told of a range, m, of a surface whose normal is seen at that cosine.
    #[must_use]
    pub fn range(&self, range: f64, cosine: f64) -> f64 {
        range * (1.0 + self.range_scale) + self.range_bias + self.incidence * (1.0 - cosine)
    }

    /// What a bearing in S (rad) is told too far counter-clockwise, rad.
    #[must_use]
    pub fn bearing(&self, bearing: f64) -> f64 {
        let harmonic = |order: f64, amplitude_deg: f64, phase_deg: f64| {
            amplitude_deg.to_radians() * libm::sin(order * (bearing - phase_deg.to_radians()))
        };
        harmonic(1.0, self.first_harmonic_deg, self.first_phase_deg)
            + harmonic(2.0, self.second_harmonic_deg, self.second_phase_deg)
    }
}

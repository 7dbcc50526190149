//! The corner between the beams: where the lines through both sides of a candidate meet (K 3.1.2).

use super::parameters::{LineGate, Parameters};
use crate::geometry::ScanPoint;
use crate::sensing::line::{Line, intersection_covariance, largest_variance};
use crate::sensing::neighbourhood::Disc;

impl LineGate {
    /// Whether a side's points are near enough to its line.
    pub(super) fn is_straight(&self, line: &Line) -> bool {
        line.mean_square() <= self.residual * self.residual
    }
}

/// An intersection of two lines near a candidate.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corner {
    /// Position relative to the candidate, m.
    pub relative: ScanPoint,
    /// Covariance xx, xy, yy, m^2.
    pub covariance: [f32; 3],
    /// Largest variance in any direction, m^2.
    pub variance: f32,
    before: Line,
    after: Line,
    /// Unit vector from the sensor to the candidate.
    ray: ScanPoint,
}

impl Corner {
    /// None if the lines meet nowhere near the candidate.
    pub(super) fn between(before: Line, after: Line, disc: &Disc, parameters: &Parameters) -> Option<Self> {
        let relative = before.intersection(&after)?;
        if relative.norm() >= parameters.sub_beam_limit {
            return None;
        }
        let ray = disc.centre / disc.centre.norm().max(1e-6);
        let noise = parameters.range_deviation * parameters.range_deviation;
        let mut covariance = intersection_covariance(
            (&before, before.variance_at(relative, ray, noise)),
            (&after, after.variance_at(relative, ray, noise)),
        );
        let floor = parameters.deviation_floor * parameters.deviation_floor;
        covariance[0] += floor;
        covariance[2] += floor;
        Some(Self { relative, covariance, variance: largest_variance(covariance), before, after, ray })
    }

    /// Whether straight lines are good enough, if neighbouring beams are `beam_width` (m) apart at the candidate.
    pub(super) fn passes(&self, gate: &LineGate, beam_width: f32) -> bool {
        let sideways = libm::fabsf(self.ray.x * self.relative.y - self.ray.y * self.relative.x);
        let sine = libm::fabsf(self.before.along.dot(&self.after.normal()));
        let is_concave = (self.before.centroid + self.after.centroid).dot(&self.ray) < 0.0;
        let slant = |line: &Line| libm::fabsf(line.normal().dot(&self.ray));
        let least_slant = slant(&self.before).min(slant(&self.after));
        sine >= gate.sine
            && self.variance <= gate.deviation * gate.deviation
            && sideways <= gate.beams * beam_width
            && !(is_concave && beam_width > gate.concave_spacing * least_slant)
    }
}

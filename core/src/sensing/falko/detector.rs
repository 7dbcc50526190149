//! The detector.

use heapless::Vec;

use super::corner::Corner;
use super::end_point;
use super::parameters::{Parameters, SuppressionRule};
use super::runs::Runs;
use super::score::{PairSum, Sectors};
use super::suppression::{Cost, is_best_within, walk};
use crate::geometry::ScanPoint;
use crate::sensing::keypoint::keep_best;
use crate::sensing::line::Moments;
use crate::sensing::neighbourhood::{Disc, Reach, Side, beams_within};
use crate::sensing::{Keypoint, KeypointKind, PointScan};

/// Finds the keypoints of scans with up to `BEAMS` beams; owns its scratch memory, 12 bytes a beam.
#[derive(Clone, Debug)]
pub struct Detector<const BEAMS: usize> {
    parameters: Parameters,
    sectors: Sectors,
    costs: [Cost; BEAMS],
    runs: Runs<BEAMS>,
}

/// Beams whose windows are computed together. One alone would be a chain of waiting for exponentials and quotients, at the end of
/// which the processor guesses wrong where the neighbourhood ends.
const AHEAD: usize = 16;

/// Where neighbours of a candidate may be.
#[derive(Clone, Copy, Debug)]
struct Window {
    /// Radius of the disc, m.
    radius: f32,
    /// Shortest base and height of the triangle, m.
    shortest: f32,
    /// Beams before the candidate; none if it is no candidate.
    before: u16,
    /// Beams after it.
    after: u16,
}

impl Window {
    const NONE: Self = Self { radius: 0.0, shortest: 0.0, before: 0, after: 0 };
}

/// A candidate's neighbourhood.
#[derive(Clone, Copy, Debug)]
struct Neighbourhood {
    disc: Disc,
    reach: Reach,
    /// Height of the triangle, m.
    height: f32,
}

impl<const BEAMS: usize> Detector<BEAMS> {
    /// A detector with the given parameters.
    #[must_use]
    #[inline(always)]
    pub fn new(parameters: Parameters) -> Self {
        Self {
            parameters,
            sectors: Sectors::new(parameters.sectors, parameters.sectors_centred),
            costs: [Cost::NONE; BEAMS],
            runs: Runs::new(),
        }
    }

    /// The parameters of the detector.
    #[must_use]
    pub fn parameters(&self) -> &Parameters {
        &self.parameters
    }

    /// Replaces `keypoints` by those of `scan`, in the frame of its points: corners in order of beams, then ends of
    /// faces in order of beams. If there are more than fit, those are kept, in any order, whose positions are known best.
    /// Returns how many did not fit.
    pub fn detect<const KEYPOINTS: usize>(
        &mut self,
        scan: &PointScan<BEAMS>,
        keypoints: &mut Vec<Keypoint, KEYPOINTS>,
    ) -> usize {
        keypoints.clear();
        let mut left_out = 0;
        let mut keep = |keypoint: Keypoint| left_out += usize::from(keep_best(keypoints, keypoint));
        let count = scan.ranges.len().min(scan.points.len());
        if count < 3 || scan.bearing_step.is_nan() || scan.bearing_step <= 0.0 {
            return 0;
        }
        let crosses_seam = scan.is_full_circle && self.parameters.crosses_seam;
        if let Some(jump) = self.parameters.jump {
            self.runs.find(scan, crosses_seam, jump);
        }

        let worst = self.weigh(scan, count, crosses_seam);
        let costs = self.costs.get(..count).unwrap_or_default();
        let (radius, share) = (self.parameters.suppression_radius, self.parameters.score_share);
        match self.parameters.suppression {
            SuppressionRule::Distance => {
                for (index, cost) in costs.iter().enumerate() {
                    if cost.is_candidate()
                        && cost.cost <= share * worst
                        && is_best_within(scan, costs, index, radius, crosses_seam)
                        && let Some(keypoint) = self.keypoint(scan, index, cost.cost, crosses_seam)
                    {
                        keep(keypoint);
                    }
                }
            }
            SuppressionRule::BeamWindow => walk(scan, costs, radius, worst, share.min(1.0), |index| {
                let cost = costs.get(index).map_or(0.0, |cost| cost.cost);
                if let Some(keypoint) = self.keypoint(scan, index, cost, crosses_seam) {
                    keep(keypoint);
                }
            }),
        }
        if let Some(wanted) = &self.parameters.end_points {
            end_point::find(scan, &self.runs, &self.parameters, wanted, crosses_seam, &mut keep);
        }
        left_out
    }

    /// Radius of a neighbourhood at `range`, m (K 3.1.1); never reaches the sensor.
    fn radius(&self, range: f32) -> f32 {
        let radius = self.parameters.radius_scale * libm::expf(self.parameters.radius_growth * range);
        if radius >= range { 0.8 * range } else { radius }
    }

    /// Sets the cost of each of the first `count` beams. Returns the largest one of a candidate.
    fn weigh(&mut self, scan: &PointScan<BEAMS>, count: usize, crosses_seam: bool) -> f32 {
        let mut worst = 0.0_f32;
        for start in (0..count).step_by(AHEAD) {
            let beams = start..(start + AHEAD).min(count);
            let mut windows = [Window::NONE; AHEAD];
            for (window, index) in windows.iter_mut().zip(beams.clone()) {
                *window = self.window(scan, index, crosses_seam);
            }
            for (window, index) in windows.iter().zip(beams) {
                let cost = self.cost(scan, index, window);
                if cost.is_candidate() {
                    worst = worst.max(cost.cost);
                }
                if let Some(slot) = self.costs.get_mut(index) {
                    *slot = cost;
                }
            }
        }
        worst
    }

    /// Where neighbours of beam `index` may be; nowhere if the beam is no candidate.
    #[inline]
    fn window(&self, scan: &PointScan<BEAMS>, index: usize, crosses_seam: bool) -> Window {
        let Some(range) = scan.ranges.get(index).copied() else { return Window::NONE };
        if range <= 0.0 || range > self.parameters.farthest {
            return Window::NONE;
        }
        let count = scan.ranges.len();
        let most = if crosses_seam { (count - 1) / 2 } else { count };
        let limits = if self.parameters.jump.is_some() {
            (self.runs.before(index).min(most), self.runs.after(index).min(most))
        } else if crosses_seam {
            (most, most)
        } else {
            (index, count - 1 - index)
        };
        let least = self.least();
        if limits.0 < least || limits.1 < least {
            return Window::NONE;
        }
        let radius = self.radius(range);
        let beams = beams_within(radius / range, scan.bearing_step);
        // No scan has more beams than that.
        let reach = |limit: usize| beams.min(limit) as u16;
        Window {
            radius,
            before: reach(limits.0),
            after: reach(limits.1),
            shortest: radius / self.parameters.triangle_ratio,
        }
    }

    /// Fewest neighbours on each side.
    fn least(&self) -> usize {
        usize::from(self.parameters.points_a_side).max(1)
    }

    /// The neighbourhood of beam `index`. None if the beam is no candidate.
    fn neighbourhood(&self, scan: &PointScan<BEAMS>, index: usize, window: &Window) -> Option<Neighbourhood> {
        let Window { radius, before, after, shortest } = *window;
        let (range, centre) = (*scan.ranges.get(index)?, *scan.points.get(index)?);
        let disc = Disc { centre, range, radius };
        let least = self.least();
        let before = Side::before(scan, index, usize::from(before)).farthest_before(&disc)?;
        let after = Side::after(scan, index, usize::from(after)).farthest_after(&disc)?;
        if before.0 < least || after.0 < least {
            return None;
        }
        // The triangle of K 3.1.1, relative to the candidate.
        let base = after.1 - before.1;
        let squared_base = base.norm_squared();
        let doubled_area = before.1.x * after.1.y - before.1.y * after.1.x;
        let is_narrow = squared_base < shortest * shortest;
        let is_flat = doubled_area * doubled_area < shortest * shortest * squared_base;
        if is_narrow || is_flat {
            return None;
        }
        let height = libm::fabsf(doubled_area) / libm::sqrtf(squared_base);
        Some(Neighbourhood { disc, reach: Reach { before: before.0, after: after.0 }, height })
    }

    /// What the detector holds against beam `index` being a corner.
    fn cost(&self, scan: &PointScan<BEAMS>, index: usize, window: &Window) -> Cost {
        if window.before == 0 {
            return Cost::NONE;
        }
        let Some(around) = self.neighbourhood(scan, index, window) else { return Cost::NONE };
        if self.parameters.gate.is_some() {
            let corner = self.corner(scan, index, &around);
            // The beam whose lines fix the corner best is the one at the corner.
            return corner.map_or(Cost::NONE, |corner| Cost { cost: corner.variance, height: around.height });
        }
        let before = Side::before(scan, index, around.reach.before);
        let after = Side::after(scan, index, around.reach.after);
        let Some(orientation) = self.orientation(&around, &before, &after) else { return Cost::NONE };
        let origin = self.sectors.origin(orientation);
        let score = [before, after].map(|side| {
            let mut sum = PairSum::new(&self.sectors, origin);
            side.visit(&around.disc, |relative| sum.add(relative));
            sum.value()
        });
        Cost { cost: (score[0] + score[1]) as f32, height: around.height }
    }

    /// Direction of the corner (K 3.2.3), not normalised. None if a side has too few points, or if there is none.
    fn orientation(&self, around: &Neighbourhood, before: &Side<'_>, after: &Side<'_>) -> Option<ScanPoint> {
        let least = f32::from(self.parameters.points_a_side.max(1));
        let mut orientation = ScanPoint::zeros();
        for side in [before, after] {
            let (mut count, mut sum) = (0.0_f32, ScanPoint::zeros());
            side.visit(&around.disc, |relative| {
                count += 1.0;
                sum += relative;
            });
            if count < least {
                return None;
            }
            orientation += sum / count;
        }
        (orientation.norm_squared() > 1e-12).then_some(orientation)
    }

    /// The corner between the beams (K 3.1.2). None if the lines do not meet near the candidate, or fail the gate.
    fn corner(&self, scan: &PointScan<BEAMS>, index: usize, around: &Neighbourhood) -> Option<Corner> {
        let least = f32::from(self.parameters.points_a_side);
        let fit = |side: Side<'_>| {
            let mut moments = Moments::default();
            side.visit(&around.disc, |relative| moments.add(relative));
            let is_enough = moments.count >= least;
            if self.parameters.lines_include_corner {
                moments.add(ScanPoint::zeros());
            }
            let line = is_enough.then(|| moments.line()).flatten();
            line.filter(|line| self.parameters.gate.is_none_or(|gate| gate.is_straight(line)))
        };
        let before = fit(Side::before(scan, index, around.reach.before))?;
        let after = fit(Side::after(scan, index, around.reach.after))?;
        let corner = Corner::between(before, after, &around.disc, &self.parameters)?;
        let passes =
            self.parameters.gate.is_none_or(|gate| corner.passes(&gate, scan.bearing_step * around.disc.range));
        passes.then_some(corner)
    }

    /// Covariance of a corner that is known only to lie near its beam's return, m^2.
    fn own_covariance(&self) -> [f32; 3] {
        let limit = self.parameters.sub_beam_limit;
        let variance = limit * limit / 12.0 + self.parameters.range_deviation * self.parameters.range_deviation;
        [variance, 0.0, variance]
    }

    fn keypoint(&self, scan: &PointScan<BEAMS>, index: usize, score: f32, crosses_seam: bool) -> Option<Keypoint> {
        let around = self.neighbourhood(scan, index, &self.window(scan, index, crosses_seam))?;
        let before = Side::before(scan, index, around.reach.before);
        let after = Side::after(scan, index, around.reach.after);
        let orientation = self.orientation(&around, &before, &after)?;
        let (position, covariance) = match self.corner(scan, index, &around) {
            Some(corner) => (around.disc.centre + corner.relative, corner.covariance),
            None if self.parameters.gate.is_some() => return None,
            None => (around.disc.centre, self.own_covariance()),
        };
        Some(Keypoint {
            kind: KeypointKind::Corner,
            beam: index as u16,
            position,
            covariance,
            orientation: libm::atan2f(orientation.y, orientation.x),
            radius: around.disc.radius,
            score,
        })
    }
}

impl<const BEAMS: usize> Default for Detector<BEAMS> {
    fn default() -> Self {
        Self::new(Parameters::default())
    }
}

//! The detector.

use heapless::Vec;

use super::candidates::Candidates;
use super::end_point::Faces;
use super::parameters::{Parameters, SuppressionRule};
use super::runs::{Beams, Runs};
use super::score::Sectors;
use super::suppression::{Cost, is_best_within, walk};
use crate::sensing::keypoint::keep_best;
use crate::sensing::{Keypoint, PointScan, PointView};

/// Finds the keypoints of scans with up to `BEAMS` beams; owns its scratch memory, 12 bytes a beam.
#[derive(Clone, Debug)]
pub struct Detector<const BEAMS: usize> {
    parameters: Parameters,
    sectors: Sectors,
    costs: [Cost; BEAMS],
    runs: Runs<BEAMS>,
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
        let (Some(points), Some(ranges)) = (scan.points.get(..count), scan.ranges.get(..count)) else { return 0 };
        let scan = &PointView { points, ranges, ..scan.view() };
        if count < 3 || scan.bearing_step.is_nan() || scan.bearing_step <= 0.0 {
            return 0;
        }
        let crosses_seam = scan.is_full_circle && self.parameters.crosses_seam;
        let parameters = &self.parameters.for_beams(scan.bearing_step);
        match parameters.jump {
            Some(jump) => self.runs.find(scan, crosses_seam, jump),
            None => self.runs.set_unbroken(count, crosses_seam),
        }
        let runs = self.runs.lengths(count);
        let candidates = Candidates { scan, runs, crosses_seam, parameters, sectors: &self.sectors };

        let costs = self.costs.get_mut(..count).unwrap_or_default();
        let worst = candidates.weigh(costs);
        let (radius, share) = (parameters.suppression_radius, parameters.score_share);
        match parameters.suppression {
            SuppressionRule::Distance => {
                for (index, cost) in costs.iter().enumerate() {
                    if cost.is_candidate()
                        && cost.cost <= share * worst
                        && is_best_within(scan, costs, index, radius, crosses_seam)
                        && let Some(keypoint) = candidates.keypoint(index, cost.cost)
                    {
                        keep(keypoint);
                    }
                }
            }
            SuppressionRule::BeamWindow => walk(scan, costs, radius, worst, share.min(1.0), |index| {
                let cost = costs.get(index).map_or(0.0, |cost| cost.cost);
                if let Some(keypoint) = candidates.keypoint(index, cost) {
                    keep(keypoint);
                }
            }),
        }
        if let Some(wanted) = &parameters.end_points {
            let beams = Beams { points, ranges, crosses_seam };
            let faces = Faces { beams, bearing_step: scan.bearing_step, runs, parameters, wanted };
            faces.find_ends(&mut keep);
        }
        left_out
    }
}

impl<const BEAMS: usize> Default for Detector<BEAMS> {
    fn default() -> Self {
        Self::new(Parameters::default())
    }
}

//! Association of keypoints by trying random pairs of correspondences (RANSAC, K 4.2.2).

use heapless::Vec;

use super::correspondence::{Correspondence, common_points, refine};
use agv_core::geometry::{RigidFit, fit_rigid};
use agv_core::sensing::Keypoint;

/// How many trials are made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RandomSampleParameters {
    /// Share of the correspondences offered that are expected to be right (K 4.2.2: 0.7).
    pub inlier_probability: f64,
    /// Probability with which all trials may miss; with the above it states the number of trials.
    pub failure_probability: f64,
    /// Keypoints closer than this after alignment are the same, m.
    pub radius: f32,
}

impl Default for RandomSampleParameters {
    fn default() -> Self {
        Self { inlier_probability: 0.7, failure_probability: 1e-9, radius: 0.1 }
    }
}

/// Most correspondences that are drawn from.
const OFFERED: usize = 256;

/// Most trials.
const MOST_TRIALS: f64 = 4096.0;

/// Draws pairs of correspondences; its sequence is fixed by the seed.
#[derive(Clone, Debug)]
pub struct RandomSample {
    state: u64,
    offered: Vec<Correspondence, OFFERED>,
}

impl RandomSample {
    /// A generator with that seed.
    #[must_use]
    pub const fn new(seed: u64) -> Self {
        Self { state: seed, offered: Vec::new() }
    }

    /// Offers a correspondence to the next [`RandomSample::associate`]; surplus ones are left out.
    pub fn offer(&mut self, correspondence: Correspondence) {
        let _ = self.offered.push(correspondence);
    }

    /// Fits the pose of the source in the target to random pairs of the offered correspondences and keeps the one under
    /// which most keypoints meet. None if none fits two. Forgets what was offered.
    pub fn associate(
        &mut self,
        source: &[Keypoint],
        target: &[Keypoint],
        parameters: &RandomSampleParameters,
    ) -> Option<RigidFit> {
        let pair_probability = parameters.inlier_probability * parameters.inlier_probability;
        let trials = libm::log(parameters.failure_probability) / libm::log1p(-pair_probability);
        let trials = trials.clamp(1.0, MOST_TRIALS) as u32;
        let mut best: Option<(usize, RigidFit)> = None;
        for _ in 0..trials {
            let (Some(first), Some(second)) = (self.draw(), self.draw()) else { break };
            if first.source == second.source || first.target == second.target {
                continue;
            }
            let pairs = [first, second];
            let points = pairs.iter().filter_map(|pair| {
                let from = source.get(usize::from(pair.source))?.position.cast();
                Some((from, target.get(usize::from(pair.target))?.position.cast(), 1.0))
            });
            let Some(alignment) = fit_rigid(points).filter(|found| found.residual <= f64::from(parameters.radius))
            else {
                continue;
            };
            let count = common_points(source, target, &alignment.pose, parameters.radius);
            if best.as_ref().is_none_or(|(most, _)| count > *most) {
                best = Some((count, alignment));
            }
        }
        self.offered.clear();
        let (_, alignment) = best?;
        Some(refine(source, target, &alignment.pose, parameters.radius).unwrap_or(alignment))
    }

    fn draw(&mut self) -> Option<Correspondence> {
        // A linear congruential generator; its upper bits are the random ones.
        self.state = self.state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let count = self.offered.len() as u64;
        self.offered.get((((self.state >> 33) * count) >> 31) as usize).copied()
    }
}

//! Cumulative Gaussian histogram: in which directions from a keypoint its neighbours lie (CGH, K 3.2.2).

use agv_core::geometry::ScanPoint;
use agv_core::sensing::falko::Sectors;
use agv_core::sensing::{Keypoint, PointScan, visit_around};

/// Bins of a histogram, alpha_n.
const BINS: usize = 16;

/// Bins to each side over which one point is spread.
const REACH: usize = 3;

/// Weights below this share of the middle one count as zero.
const LEAST_WEIGHT: f32 = 0.01;

/// How much a point weighs in its own bin and in the bins beside it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kernel([f32; REACH + 1]);

impl Kernel {
    /// A sampled Gaussian with a standard deviation of `sigma` bins (K 3.3.2: 0.6); weights below a hundredth of the
    /// middle one, and those more than three bins away, are left out. Zero or less puts all weight into the middle.
    #[must_use]
    pub fn gaussian(sigma: f32) -> Self {
        let mut weights = [1.0, 0.0, 0.0, 0.0];
        for (weight, bins) in weights.iter_mut().zip(0_u8..).skip(1) {
            let share = f32::from(bins) / sigma;
            let value = libm::expf(-0.5 * share * share);
            *weight = if sigma > 0.0 && value >= LEAST_WEIGHT { value } else { 0.0 };
        }
        Self(weights)
    }
}

/// Share of the neighbours that lie in each of 16 directions, blurred (K 3.13, 3.14), with sum one.
///
/// Directions are measured from the corner's own orientation (K 3.2.3) and by the direction of the vector: the printed
/// tan^-1 of a quotient would fold opposite directions.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CumulativeGaussianHistogram([f32; BINS]);

impl CumulativeGaussianHistogram {
    /// Number of bins.
    pub const BINS: u8 = BINS as u8;

    /// Describes the surroundings of a keypoint of `scan` within `radius` (m) of its beam's return; all bins are zero if
    /// there are none. `sectors` has [`Self::BINS`] sectors; surplus ones are not looked at.
    #[must_use]
    pub fn describe<const BEAMS: usize>(
        scan: &PointScan<BEAMS>,
        keypoint: &Keypoint,
        radius: f32,
        sectors: &Sectors,
        kernel: &Kernel,
    ) -> Self {
        let (sine, cosine) = libm::sincosf(keypoint.orientation);
        let origin = sectors.origin(ScanPoint::new(cosine, sine));
        let mut counts = [0_u16; BINS];
        let mut total = 0_u16;
        visit_around(scan, usize::from(keypoint.beam), radius, |relative| {
            if let Some(count) = counts.get_mut(sectors.index(origin, relative)) {
                *count = count.saturating_add(1);
                total = total.saturating_add(1);
            }
        });
        let mut bins = [0.0; BINS];
        if total == 0 {
            return Self(bins);
        }
        // Points of one bin are alike: their Gaussians are added at once.
        let whole = kernel.0.iter().sum::<f32>() * 2.0 - kernel.0.first().copied().unwrap_or(0.0);
        let unit = 1.0 / (whole * f32::from(total));
        for (bin, &count) in counts.iter().enumerate().filter(|(_, count)| **count > 0) {
            for (steps, weight) in kernel.0.iter().enumerate().filter(|(_, weight)| **weight > 0.0) {
                let share = weight * unit * f32::from(count);
                let mut add = |bin: usize| {
                    if let Some(value) = bins.get_mut(bin % BINS) {
                        *value += share;
                    }
                };
                add(bin + steps);
                if steps > 0 {
                    add(bin + BINS - steps);
                }
            }
        }
        Self(bins)
    }

    /// The bins, counter-clockwise from the corner's orientation.
    #[must_use]
    pub fn bins(&self) -> &[f32] {
        &self.0
    }

    /// Symmetric chi-square distance: sum of (a - b)^2 / (a + b), between 0 and 2.
    #[must_use]
    pub fn distance(&self, other: &Self) -> f32 {
        self.0
            .iter()
            .zip(&other.0)
            .map(|(a, b)| {
                let sum = a + b;
                if sum > 0.0 { (a - b) * (a - b) / sum } else { 0.0 }
            })
            .sum()
    }
}

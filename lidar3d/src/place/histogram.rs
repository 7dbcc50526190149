//! The thesis's signature: a histogram of how upright the surfaces are (M 5.1.3), and its distances (M 5.1, 5.2).

use super::normals::{Neighbours, vertical_parts};
use super::plane_fit::fitted_surfaces;
use crate::cloud::Cloud;

/// Bins between -1 and 1.
pub const BINS: usize = 101;

/// Numbers of normals by their vertical part: 808 bytes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Histogram(pub [f64; BINS]);

impl Histogram {
    /// The histogram of a scan.
    #[must_use]
    pub fn new(cloud: &Cloud<'_>, neighbours: &Neighbours) -> Self {
        Self::counted(|count| vertical_parts(cloud, neighbours, count))
    }

    /// The histogram of a scan by its normals of fitted planes (M 5.1.2.1).
    #[must_use]
    pub fn of_planes(cloud: &Cloud<'_>, neighbours: &Neighbours) -> Self {
        Self::counted(|count| fitted_surfaces(cloud, neighbours, |_, [_, _, part]| count(part)))
    }

    fn counted(each: impl FnOnce(&mut dyn FnMut(f32))) -> Self {
        let mut counts = [0u32; BINS];
        each(&mut |part| {
            let bin = ((part + 1.0) * (0.5 * BINS as f32)) as usize;
            if let Some(count) = counts.get_mut(bin.min(BINS - 1)) {
                *count += 1;
            }
        });
        Self(counts.map(f64::from))
    }

    /// The same with a sum of one; as it is if it is empty.
    #[must_use]
    pub fn normalised(&self) -> Self {
        let sum: f64 = self.0.iter().sum();
        Self(self.0.map(|count| if sum > 0.0 { count / sum } else { count }))
    }
}

/// Chi-square distance of two histograms of counts (M 5.1).
#[must_use]
pub fn chi_square(one: &Histogram, other: &Histogram) -> f64 {
    let pairs = one.0.iter().zip(&other.0);
    pairs.map(|(p, q)| (p - q) * (p - q) / (p + q + 1.0)).sum()
}

/// Sorensen distance (M 5.2), 0 to 1; 0 of two empty ones.
#[must_use]
pub fn sorensen(one: &Histogram, other: &Histogram) -> f64 {
    let pairs = one.0.iter().zip(&other.0);
    let (difference, sum) = pairs.fold((0.0, 0.0), |(d, s), (p, q)| (d + libm::fabs(p - q), s + p + q));
    if sum > 0.0 { difference / sum } else { 0.0 }
}

/// Chi-square distance of histograms of sum one, without the 1 that stands for a count in M 5.1; 0 to 2.
#[must_use]
pub fn normalised_chi_square(one: &Histogram, other: &Histogram) -> f64 {
    let pairs = one.0.iter().zip(&other.0).filter(|(p, q)| *p + *q > 0.0);
    pairs.map(|(p, q)| (p - q) * (p - q) / (p + q)).sum()
}

/// Sorensen distance of histograms of sum one: half the sum of the differences.
#[must_use]
pub fn normalised_sorensen(one: &Histogram, other: &Histogram) -> f64 {
    sorensen(one, other)
}

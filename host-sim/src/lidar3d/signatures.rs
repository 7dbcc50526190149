//! All signatures of a scan, and the methods that compare them.

use std::time::Instant;

use agv_lidar3d::cloud::Cloud;
use agv_lidar3d::place::{
    BINS, ENRICHED_LENGTH, Enriched, Facing, Histogram, Neighbours, Orientation, chi_square, normalised_chi_square,
    normalised_sorensen, relative_turn, sorensen,
};

/// Height of the points that the orientation is determined from, above the sensor, m, and their reach, m.
const ORIENTATION_HEIGHTS: [f32; 2] = [-1.4, 1.1];
const ORIENTATION_REACH: f32 = 50.0;

/// What is compared, and how.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// The thesis's histogram, chi-square of counts (M 5.1).
    ChiSquare,
    /// The thesis's histogram, Sorensen (M 5.2).
    Sorensen,
    /// Chi-square of shares.
    NormalisedChiSquare,
    /// Sorensen of shares.
    NormalisedSorensen,
    /// Normals, heights and ranges (M 6.3).
    Enriched,
}

impl Method {
    /// All of them.
    pub const ALL: [Self; 5] =
        [Self::ChiSquare, Self::Sorensen, Self::NormalisedChiSquare, Self::NormalisedSorensen, Self::Enriched];

    /// What people call it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::ChiSquare => "thesis chi-square",
            Self::Sorensen => "thesis Sorensen",
            Self::NormalisedChiSquare => "normalised chi-square",
            Self::NormalisedSorensen => "normalised Sorensen",
            Self::Enriched => "enriched",
        }
    }

    /// The same where an answer is given only if the walls face the same way.
    #[must_use]
    pub fn checked_name(self) -> &'static str {
        match self {
            Self::ChiSquare => "thesis chi-square, checked",
            Self::Sorensen => "thesis Sorensen, checked",
            Self::NormalisedChiSquare => "normalised chi-square, checked",
            Self::NormalisedSorensen => "normalised Sorensen, checked",
            Self::Enriched => "enriched, checked",
        }
    }

    /// Size of a signature, bytes.
    #[must_use]
    pub fn bytes(self) -> usize {
        if self == Self::Enriched { ENRICHED_LENGTH } else { 8 * BINS }
    }

    /// How far apart two scans are.
    #[must_use]
    pub fn distance(self, one: &Signatures, other: &Signatures) -> f64 {
        match self {
            Self::ChiSquare => chi_square(&one.counts, &other.counts),
            Self::Sorensen => sorensen(&one.counts, &other.counts),
            Self::NormalisedChiSquare => normalised_chi_square(&one.shares, &other.shares),
            Self::NormalisedSorensen => normalised_sorensen(&one.shares, &other.shares),
            Self::Enriched => f64::from(one.enriched.distance(&other.enriched)),
        }
    }
}

/// All signatures of a scan.
#[derive(Clone, Debug, PartialEq)]
pub struct Signatures {
    /// Normals by their vertical part.
    pub counts: Histogram,
    /// The same as shares.
    pub shares: Histogram,
    /// The enriched one.
    pub enriched: Enriched,
    /// Distances by direction.
    pub orientation: Orientation,
    /// Walls by the direction in which they face.
    pub facing: Facing,
}

impl Signatures {
    /// Of a scan whose sensor stands `sensor_height` m above the ground.
    #[must_use]
    pub fn new(cloud: &Cloud<'_>, sensor_height: f32) -> Self {
        Self::timed(cloud, sensor_height).0
    }

    /// As [`Self::new`], with the seconds for the histogram, and for the enriched signature with it.
    #[must_use]
    pub fn timed(cloud: &Cloud<'_>, sensor_height: f32) -> (Self, [f64; 2]) {
        let start = Instant::now();
        let counts = Histogram::new(cloud, &Neighbours::default());
        let histogram = start.elapsed().as_secs_f64();
        let enriched = Enriched::new(cloud, &counts, sensor_height);
        let both = start.elapsed().as_secs_f64();
        let [low, high] = ORIENTATION_HEIGHTS;
        let orientation = Orientation::of_heights(cloud, low, high, ORIENTATION_REACH);
        let facing = Facing::new(cloud, &Neighbours::default());
        (Self { shares: counts.normalised(), counts, enriched, orientation, facing }, [histogram, both])
    }

    /// The angle by which the sensor has turned to the left since `other`, rad, -pi to pi.
    #[must_use]
    pub fn turn_since(&self, other: &Self) -> f64 {
        f64::from(relative_turn((&other.orientation, &other.facing), (&self.orientation, &self.facing)))
    }
}

/// Height of the sensor above the ground, m: the median of the low points between 5 and 15 m.
#[must_use]
pub fn sensor_height(points: &[Option<[f32; 3]>]) -> f32 {
    let near = |[x, y, z]: &[f32; 3]| (5.0..15.0).contains(&x.hypot(*y)) && *z < -0.5;
    let mut heights: Vec<f32> = points.iter().flatten().filter(|point| near(point)).map(|[_, _, z]| -z).collect();
    heights.sort_by(f32::total_cmp);
    heights.get(heights.len() / 2).copied().unwrap_or(0.0)
}

//! From a scan to the place where it was taken: signature, candidates, association, acceptance.

use agv_core::geometry::Pose;
use agv_core::sensing::falko::{Parameters, Sectors};
use agv_places::{
    AffineHough, Candidate, Compatibility, Correspondence, CorrespondenceGraph, Glare, GlareParameters, GlareTables,
    HoughParameters, PlaceIndex, PlaceView, RandomSample, RandomSampleParameters, RecognitionParameters, Recognizer,
    common_points, surface_normal,
};
use agv_places::{CumulativeGaussianHistogram, Kernel};
use serde::Serialize;

use super::DescribedScan;
pub use agv_host_sim::places::{CANDIDATES, LEAST_CONFIDENCE, PLACES};

/// How a place is recognised.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// GLAROT and the correspondence graph (K 4.1.2).
    GlarotCg,
    /// GLAROT and the affine Hough transform (K 4.1.3).
    GlarotAh,
    /// GLAROT and random samples.
    GlarotRansac,
    /// Signatures of surface normals and random samples.
    Gsr,
    /// Ends of faces as further keypoints, GLAROT, graph with orientations, alignment and comparison of the scans.
    Improved,
}

impl Method {
    /// All methods.
    pub const ALL: [Self; 5] = [Self::GlarotCg, Self::GlarotAh, Self::GlarotRansac, Self::Gsr, Self::Improved];

    /// The detectors whose keypoints it uses.
    #[must_use]
    pub fn detectors(self) -> &'static [Parameters] {
        const PRINTED: [Parameters; 1] = [Parameters::thesis()];
        const IMPROVED: [Parameters; 2] = [Parameters::place_corners(), Parameters::place_ends()];
        if self == Self::Improved { &IMPROVED } else { &PRINTED }
    }

    /// Signature of a scan.
    #[must_use]
    pub fn signature(self, scan: &DescribedScan, tables: &GlareTables) -> Glare {
        if self != Self::Gsr {
            return Glare::of(&scan.positions(), tables);
        }
        let faced = scan.keypoints.iter().filter_map(|keypoint| {
            Some((keypoint.position, surface_normal(&scan.points, keypoint.position, NORMAL_RADIUS)?))
        });
        let (positions, normals): (Vec<_>, Vec<_>) = faced.unzip();
        Glare::of_normals(&positions, &normals, tables)
    }

    /// Replaces `found` by the most similar admissible places.
    pub fn search(
        self,
        index: &PlaceIndex<PLACES>,
        signature: &Glare,
        is_admissible: impl Fn(u32) -> bool,
        found: &mut heapless::Vec<Candidate, CANDIDATES>,
    ) {
        if self == Self::Gsr {
            index.search_unshifted(signature, is_admissible, found);
        } else {
            index.search(signature, is_admissible, found);
        }
    }
}

/// Keypoints closer than this after alignment are the same, m (K 4.2.1).
const COMMON_RADIUS: f32 = 0.1;
/// Neighbourhood from which a normal is computed, m.
const NORMAL_RADIUS: f32 = 0.3;
/// Radius of a descriptor, m (K 3.3.2).
const DESCRIPTOR_RADIUS: f32 = 0.5;
/// Standard deviation of a histogram's kernel, bins (K 3.3.2).
const DESCRIPTOR_SIGMA: f32 = 0.6;
/// Keypoints of the other scan that are offered to random sampling for each keypoint.
const OFFERED: usize = 3;

/// A pose at a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Answer {
    /// Pose of the query in the frame of the place.
    pub pose: Pose,
    /// Keypoints that support it.
    pub points: usize,
    /// How sure it is; more is surer.
    pub score: f64,
}

/// Memory of the associations.
#[derive(Default)]
pub struct Memory {
    graph: Box<CorrespondenceGraph<1024, 32>>,
    hough: Box<AffineHough>,
    recognizer: Box<Recognizer<1024, 32>>,
}

impl Memory {
    /// The pose of the query at a place. None if they do not correspond.
    pub fn associate(&mut self, method: Method, query: &DescribedScan, place: &DescribedScan) -> Option<Answer> {
        let (source, target) = (&query.keypoints, &place.keypoints);
        let pose = match method {
            Method::GlarotCg => self.graph.associate(source, target, &Compatibility::thesis())?.0.pose,
            Method::GlarotAh => self.hough.associate(source, target, &HoughParameters::default())?.pose,
            Method::GlarotRansac | Method::Gsr => random_sample(query, place)?,
            Method::Improved => {
                let found = self.recognizer.recognise(
                    &PlaceView { points: &query.points, keypoints: source },
                    &PlaceView { points: &place.points, keypoints: target },
                    &RecognitionParameters::default(),
                )?;
                return Some(Answer { pose: found.pose, points: found.points, score: f64::from(found.confidence()) });
            }
        };
        let points = common_points(source, target, &pose, COMMON_RADIUS);
        Some(Answer { pose, points, score: points as f64 })
    }
}

/// Tables of the signatures.
#[must_use]
pub fn tables() -> GlareTables {
    GlareTables::new(&GlareParameters::default())
}

/// Describes keypoints for random sampling.
#[must_use]
pub fn histograms(scan: &DescribedScan) -> Vec<CumulativeGaussianHistogram> {
    let sectors = Sectors::new(CumulativeGaussianHistogram::BINS, true);
    let kernel = Kernel::gaussian(DESCRIPTOR_SIGMA);
    let describe =
        |keypoint| CumulativeGaussianHistogram::describe(&scan.points, keypoint, DESCRIPTOR_RADIUS, &sectors, &kernel);
    scan.keypoints.iter().map(describe).collect()
}

/// Random samples of correspondences whose descriptors are near.
fn random_sample(query: &DescribedScan, place: &DescribedScan) -> Option<Pose> {
    let mut sample = RandomSample::new(1);
    for (source, own) in (0_u8..).zip(&query.histograms) {
        let mut near: Vec<_> =
            (0_u8..).zip(&place.histograms).map(|(target, other)| (own.distance(other), target)).collect();
        near.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (_, target) in near.into_iter().take(OFFERED) {
            sample.offer(Correspondence { source, target });
        }
    }
    let found = sample.associate(&query.keypoints, &place.keypoints, &RandomSampleParameters::default())?;
    Some(found.pose)
}

//! Keypoints and descriptors as K 3.3 measures them: repeatability under changes of viewpoint, noise and density, stability
//! of landmarks, and how well descriptors tell keypoints apart.

mod described;
mod disturbance;
mod pictures;
mod recognition;
mod stability;

pub use described::{DESCRIPTOR_RADII, DetectorKind, Frame, Observer};
pub use disturbance::Disturbance;
pub use pictures::page;
pub use recognition::{Comparison, RecognitionPoint, curve};
pub use stability::{Stability, stability};

use agv_core::geometry::Point;
use rayon::prelude::*;
use serde::Serialize;

use super::repeatability::{self, EVERY, OverlappingPair, same_points, share};
use agv_host_sim::import::PosedScan;

/// Mean repeatability of the pairs of one level of a test.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Level {
    /// Name of the test.
    pub test: &'static str,
    /// Viewpoint: least overlap of the free regions, in steps of a tenth; noise: standard deviation, m; oversampling and
    /// subsampling: returns put between neighbours, or taken out between remaining ones.
    pub level: f64,
    /// Mean over the pairs that both have keypoints; none if there is no such pair.
    pub repeatability: Option<f64>,
    /// Mean over all pairs; a pair in which a scan has no keypoint counts as zero.
    pub counting_empty: f64,
    /// Number of pairs.
    pub pairs: usize,
}

/// How well one descriptor tells the keypoints of one test apart.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DescriptorCurve {
    /// Name of the test: viewpoint, or one level of a disturbance.
    pub test: &'static str,
    /// Level as in [`Level`]; none for all pairs of the viewpoint test.
    pub level: Option<f64>,
    /// Share of the keypoints that both scans have, for which the nearest descriptor of the other scan is of a keypoint
    /// within 0.2 m of it.
    pub nearest_correct: f64,
    /// Precision and recall over the threshold.
    pub curve: Vec<RecognitionPoint>,
}

/// One descriptor.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DescriptorOutcome {
    /// bsc or cgh.
    pub descriptor: &'static str,
    /// Radius of the surroundings that are described, m.
    pub radius_m: f32,
    /// Time of the descriptors of a scan, us.
    pub us_per_scan: f64,
    /// Tests.
    pub tests: Vec<DescriptorCurve>,
}

/// What one detector does on a log.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Outcome {
    /// falko or oc.
    pub detector: DetectorKind,
    /// Mean number of keypoints.
    pub keypoints_per_scan: f64,
    /// Repeatability over all pairs of the viewpoint test that both have keypoints.
    pub repeatability: f64,
    /// The same over all pairs; a pair in which a scan has no keypoint counts as zero.
    pub repeatability_counting_empty: f64,
    /// Pairs of the viewpoint test.
    pub pairs: usize,
    /// Share of the keypoints that two scans have for which the nearest descriptor is right, of the best
    /// descriptor.
    pub nearest_descriptor_correct: f64,
    /// Time of detection, us.
    pub us_per_scan: f64,
    /// Repeatability by test and level.
    pub levels: Vec<Level>,
    /// Landmark stability, by radius of association.
    pub stability: Vec<Stability>,
    /// Descriptors.
    pub descriptors: Vec<DescriptorOutcome>,
}

/// Radii of association, m: as stated (K 3.3.1), and as the printed figures need.
const ASSOCIATIONS: [f64; 2] = [0.05, 0.1];

/// Noise levels, densities and so on for which descriptors are rated.
const DESCRIBED: [Disturbance; 3] =
    [Disturbance::Noise(0.05), Disturbance::Oversampling(1), Disturbance::Subsampling(1)];

/// Measures one detector on scans with known poses; `done` is called after each part.
#[must_use]
pub fn run(kind: DetectorKind, scans: &[PosedScan], pairs: &[OverlappingPair], done: impl Fn() + Sync) -> Outcome {
    let frames = Observer::new(kind).observe_all(scans.iter().map(|scan| &scan.scan));
    let world: Vec<Vec<Point>> = frames.iter().zip(scans).map(|(frame, scan)| frame.positions(&scan.laser)).collect();
    let positions: Vec<Vec<Point>> = frames.iter().map(|frame| frame.positions(&Default::default())).collect();
    let score = repeatability::score(scans, &positions, pairs);
    done();
    let mut levels = viewpoint_levels(&world, pairs);
    let references: Vec<usize> = (0..scans.len()).step_by(EVERY).collect();
    let disturbed = |disturbance: Disturbance| {
        let changed: Vec<_> =
            references.iter().map(|&index| disturbance.of(&scans[index].scan, index as u64)).collect();
        Observer::new(kind).observe_all(&changed)
    };
    let (us_per_scan, descriptor_us) = described::times(kind, scans);
    let mut descriptors = unrated(descriptor_us);
    let viewed: Vec<_> = pairs
        .iter()
        .map(|pair| {
            let (first, second) = (pair.reference, pair.other);
            (&frames[first], &frames[second], world[first].clone(), world[second].clone())
        })
        .collect();
    describe(&mut descriptors, "viewpoint", None, &viewed);
    done();
    for disturbance in Disturbance::ALL {
        let (test, level) = disturbance.name();
        let changed = disturbed(disturbance);
        let compared: Vec<_> = references
            .iter()
            .zip(&changed)
            .map(|(&index, frame)| {
                (&frames[index], frame, positions[index].clone(), frame.positions(&Default::default()))
            })
            .collect();
        let shares = compared.iter().map(|(_, _, first, second)| share(first, second));
        levels.push(mean_level(test, level, shares.collect()));
        if DESCRIBED.contains(&disturbance) {
            describe(&mut descriptors, test, Some(level), &compared);
        }
        done();
    }
    let stability = ASSOCIATIONS.map(|association| stability(&world, association)).to_vec();
    let nearest = descriptors.iter().filter_map(|outcome| outcome.tests.first().map(|test| test.nearest_correct));
    let nearest = nearest.fold(0.0, f64::max);
    Outcome {
        detector: kind,
        keypoints_per_scan: positions.iter().map(Vec::len).sum::<usize>() as f64 / scans.len().max(1) as f64,
        repeatability: score.excluding_empty,
        repeatability_counting_empty: score.counting_empty,
        pairs: score.pairs,
        nearest_descriptor_correct: nearest,
        us_per_scan,
        levels,
        stability,
        descriptors,
    }
}

/// The descriptors, none of them rated yet.
fn unrated(us: [[f64; 2]; DESCRIPTOR_RADII.len()]) -> Vec<DescriptorOutcome> {
    let of_radius = |(radius_m, us): (_, [f64; 2])| {
        [("bsc", us[0]), ("cgh", us[1])].map(|(descriptor, us_per_scan)| DescriptorOutcome {
            descriptor,
            radius_m,
            us_per_scan,
            tests: Vec::new(),
        })
    };
    DESCRIPTOR_RADII.into_iter().zip(us).flat_map(of_radius).collect()
}

fn describe(outcomes: &mut [DescriptorOutcome], test: &'static str, level: Option<f64>, compared: &[Compared]) {
    for (number, outcome) in outcomes.iter_mut().enumerate() {
        let radius = number / 2;
        outcome.tests.push(rate(test, level, compared, |a, i, b, j| match number % 2 {
            0 => a.shapes[radius][i].distance(&b.shapes[radius][j]) as f32,
            _ => a.histograms[radius][i].distance(&b.histograms[radius][j]),
        }));
    }
}

fn viewpoint_levels(world: &[Vec<Point>], pairs: &[OverlappingPair]) -> Vec<Level> {
    let tenth = |pair: &OverlappingPair| ((pair.overlap.min(0.999) * 10.0).floor() as usize).min(9);
    let shares: Vec<_> =
        pairs.par_iter().map(|pair| (tenth(pair), share(&world[pair.reference], &world[pair.other]))).collect();
    let level = |number: usize| {
        let of_level = shares.iter().filter(|(tenth, _)| *tenth == number).map(|(_, share)| *share);
        mean_level("viewpoint", number as f64 / 10.0, of_level.collect())
    };
    (5..10).map(level).filter(|level| level.pairs > 0).collect()
}

fn mean_level(test: &'static str, level: f64, shares: Vec<Option<f64>>) -> Level {
    let known: Vec<f64> = shares.iter().flatten().copied().collect();
    let sum = known.iter().fold(0.0, |sum, share| sum + share);
    Level {
        test,
        level,
        repeatability: (!known.is_empty()).then(|| sum / known.len() as f64),
        counting_empty: sum / shares.len().max(1) as f64,
        pairs: shares.len(),
    }
}

/// Two scans with their keypoints in one frame, m.
type Compared<'a> = (&'a Frame, &'a Frame, Vec<Point>, Vec<Point>);

/// Rates a distance between descriptors over pairs of scans, whose keypoints are also given in one frame.
fn rate(
    test: &'static str,
    level: Option<f64>,
    compared: &[Compared],
    distance: impl Fn(&Frame, usize, &Frame, usize) -> f32 + Sync,
) -> DescriptorCurve {
    let rated = compared.par_iter().map(|(first, second, first_points, second_points)| {
        let same = same_points(first_points, second_points);
        let mut comparisons = Vec::new();
        let mut right = 0;
        for i in 0..first_points.len() {
            let counterpart = same.iter().find(|(own, _)| *own == i).map(|(_, other)| *other);
            let distances: Vec<f32> = (0..second_points.len()).map(|j| distance(first, i, second, j)).collect();
            comparisons.extend(
                distances
                    .iter()
                    .enumerate()
                    .map(|(j, &distance)| Comparison { distance, is_same: counterpart == Some(j) }),
            );
            let nearest = distances.iter().enumerate().min_by(|a, b| a.1.total_cmp(b.1)).map(|(j, _)| j);
            right += usize::from(counterpart.is_some() && nearest == counterpart);
        }
        (comparisons, right, same.len())
    });
    let (mut comparisons, mut right, mut all) = (Vec::new(), 0, 0);
    for (compared, correct, same) in rated.collect::<Vec<_>>() {
        comparisons.extend(compared);
        right += correct;
        all += same;
    }
    DescriptorCurve { test, level, nearest_correct: right as f64 / all.max(1) as f64, curve: curve(&mut comparisons) }
}

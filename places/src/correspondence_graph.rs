//! Association of the keypoints of two scans by what does not depend on where they were taken (K 4.1.2).

use heapless::Vec;

use super::Clique;
use super::correspondence::{Correspondence, align_correspondences};
use super::maximum_clique::Graph;
use agv_core::geometry::{RigidFit, ScanPoint};
use agv_core::sensing::Keypoint;

/// When two correspondences can both be true.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Compatibility {
    /// Largest difference between the distance of two keypoints in one scan and in the other, m (K 4.2.2: 0.10).
    pub tolerance: f32,
    /// Largest angle between the orientations of two corresponding keypoints once the scans are turned to fit, rad; none if
    /// orientations are not compared. Comparing them refuses mirror images at once.
    pub orientation: Option<f32>,
    /// Whether keypoints must be of the same kind to correspond.
    pub same_kind: bool,
    /// Branches after which the search for the largest set is given up.
    pub most_steps: u32,
}

impl Default for Compatibility {
    fn default() -> Self {
        Self { tolerance: 0.1, orientation: Some(0.5), same_kind: true, most_steps: 2000 }
    }
}

impl Compatibility {
    /// Distances only, as printed.
    #[must_use]
    pub const fn thesis() -> Self {
        Self { tolerance: 0.1, orientation: None, same_kind: false, most_steps: 20_000 }
    }
}

/// Most keypoints of a scan that are looked at.
const KEYPOINTS: usize = 32;

/// Most pairs of keypoints of one scan.
const PAIRS: usize = KEYPOINTS * (KEYPOINTS - 1) / 2;

/// Correspondences as the vertices of a graph whose edges join those that can both be true: memory for up to
/// `VERTICES` correspondences, `WORDS` of which are 32 each.
#[derive(Clone, Debug)]
pub struct CorrespondenceGraph<const VERTICES: usize = 512, const WORDS: usize = 16> {
    graph: Graph<VERTICES, WORDS>,
    vertices: Vec<Correspondence, VERTICES>,
    /// Vertex of each source keypoint's correspondence with each target keypoint; one more than its number, or zero.
    numbers: [[u16; KEYPOINTS]; KEYPOINTS],
    /// Pairs of target keypoints, by length.
    target_pairs: Vec<Pair, PAIRS>,
}

#[derive(Clone, Copy, Debug)]
struct Pair {
    length: f32,
    first: u8,
    second: u8,
}

impl<const VERTICES: usize, const WORDS: usize> Default for CorrespondenceGraph<VERTICES, WORDS> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const VERTICES: usize, const WORDS: usize> CorrespondenceGraph<VERTICES, WORDS> {
    /// An empty graph.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            graph: Graph::new(),
            vertices: Vec::new(),
            numbers: [[0; KEYPOINTS]; KEYPOINTS],
            target_pairs: Vec::new(),
        }
    }

    /// Finds the largest set of correspondences any two of which can both be true, and fits the pose of the source in the
    /// target to it. The first 32 keypoints of each scan are looked at. None if fewer than two correspond, or if
    /// the set fits no proper rotation: the mirror image of a place has the same distances.
    pub fn associate(
        &mut self,
        source: &[Keypoint],
        target: &[Keypoint],
        compatibility: &Compatibility,
    ) -> Option<(RigidFit, Clique)> {
        let source = source.get(..KEYPOINTS).unwrap_or(source);
        let target = target.get(..KEYPOINTS).unwrap_or(target);
        self.build(source, target, compatibility);
        let clique = self.graph.maximum_clique(compatibility.most_steps);
        if clique.vertices.len() < 2 {
            return None;
        }
        let pairs = clique.vertices.iter().filter_map(|vertex| self.vertices.get(usize::from(*vertex)).copied());
        let alignment = align_correspondences(source, target, pairs)?;
        (alignment.residual <= f64::from(compatibility.tolerance)).then_some((alignment, clique))
    }

    /// The correspondence that a vertex stands for.
    #[must_use]
    pub fn correspondence(&self, vertex: u16) -> Option<Correspondence> {
        self.vertices.get(usize::from(vertex)).copied()
    }

    fn build(&mut self, source: &[Keypoint], target: &[Keypoint], compatibility: &Compatibility) {
        self.vertices.clear();
        for ((from, keypoint), numbers) in source.iter().enumerate().zip(&mut self.numbers) {
            for ((to, other), number) in target.iter().enumerate().zip(numbers.iter_mut()) {
                *number = 0;
                let is_alike = !compatibility.same_kind || keypoint.kind == other.kind;
                let vertex = Correspondence { source: from as u8, target: to as u8 };
                if is_alike && self.vertices.push(vertex).is_ok() {
                    *number = self.vertices.len() as u16;
                }
            }
        }
        self.graph.reset(self.vertices.len());
        self.target_pairs.clear();
        each_pair(target, |first, second, between| {
            let pair = Pair { length: between.norm(), first: first as u8, second: second as u8 };
            let _ = self.target_pairs.push(pair);
        });
        self.target_pairs.sort_unstable_by(|a, b| a.length.total_cmp(&b.length));

        let source_orientations = orientations(source);
        let target_orientations = orientations(target);
        let least_cosine = compatibility.orientation.map(libm::cosf);
        each_pair(source, |first, second, between| {
            let length = between.norm();
            let shortest = length - compatibility.tolerance;
            let start = self.target_pairs.partition_point(|pair| pair.length <= shortest);
            let rest = self.target_pairs.get(start..).unwrap_or_default();
            for pair in rest.iter().take_while(|pair| pair.length < length + compatibility.tolerance) {
                for (one, other) in [(pair.first, pair.second), (pair.second, pair.first)] {
                    let (one, other) = (usize::from(one), usize::from(other));
                    let number = |from: usize, to: usize| self.numbers.get(from)?.get(to).copied();
                    let (Some(a @ 1..), Some(b @ 1..)) = (number(first, one), number(second, other)) else { continue };
                    let is_turned_alike = || {
                        let cosine = least_cosine?;
                        let target_between = target.get(other)?.position - target.get(one)?.position;
                        let turn = Turn::between(&between, &target_between, length * pair.length);
                        let fits = |from: usize, to: usize| {
                            Some(turn.aligns(source_orientations.get(from)?, target_orientations.get(to)?, cosine))
                        };
                        Some(fits(first, one)? && fits(second, other)?)
                    };
                    if least_cosine.is_none() || is_turned_alike() == Some(true) {
                        self.graph.connect(usize::from(a) - 1, usize::from(b) - 1);
                    }
                }
            }
        });
    }
}

/// A rotation as cosine and sine.
struct Turn(ScanPoint);

impl Turn {
    /// The rotation from one vector to another whose lengths have this product.
    fn between(from: &ScanPoint, to: &ScanPoint, lengths: f32) -> Self {
        let scale = 1.0 / lengths.max(1e-9);
        Self(ScanPoint::new(from.dot(to) * scale, (from.x * to.y - from.y * to.x) * scale))
    }

    /// Whether the angle between a turned unit vector and another one has at least this cosine.
    fn aligns(&self, from: &ScanPoint, to: &ScanPoint, least_cosine: f32) -> bool {
        let turned = ScanPoint::new(self.0.x * from.x - self.0.y * from.y, self.0.y * from.x + self.0.x * from.y);
        turned.dot(to) >= least_cosine
    }
}

/// Directions of keypoints as unit vectors.
fn orientations(keypoints: &[Keypoint]) -> Vec<ScanPoint, KEYPOINTS> {
    let directions = keypoints.iter().take(KEYPOINTS).map(|keypoint| {
        let (sine, cosine) = libm::sincosf(keypoint.orientation);
        ScanPoint::new(cosine, sine)
    });
    directions.collect()
}

fn each_pair(keypoints: &[Keypoint], mut visit: impl FnMut(usize, usize, ScanPoint)) {
    for (second, keypoint) in keypoints.iter().enumerate() {
        for (first, other) in keypoints.iter().take(second).enumerate() {
            visit(first, second, keypoint.position - other.position);
        }
    }
}

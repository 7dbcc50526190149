//! From a scan to the place where it was taken: signature, candidates, association, acceptance.

use agv_core::features::Keypoint;
use agv_core::geometry::Pose;
use agv_core::places::{
    AffineHough, Candidate, Compatibility, CorrespondenceGraph, Glare, GlareParameters, GlareTables, HoughParameters,
    OverlapParameters, PlaceIndex, common_points, overlap, refine, surface_normal,
};

use super::DescribedScan;

/// Most places of a log.
pub const PLACES: usize = 8192;
/// Most candidates of a question.
pub const CANDIDATES: usize = 64;

/// How a place is recognised.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    GlarotGraph,
    GlarotHough,
    Improved,
}

/// An answer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Answer {
    pub place: usize,
    pub pose: Pose,
    pub points: usize,
    pub score: f64,
}

pub struct Memory {
    pub graph: Box<CorrespondenceGraph<1024, 32>>,
    pub hough: Box<AffineHough>,
}

impl Default for Memory {
    fn default() -> Self {
        Self { graph: Box::default(), hough: Box::default() }
    }
}

fn knob(name: &str, default: f32) -> f32 {
    std::env::var(name).ok().and_then(|v| v.parse().ok()).unwrap_or(default)
}

pub fn tables() -> GlareTables {
    GlareTables::new(&GlareParameters {
        length_step: knob("LSTEP", 0.25),
        length_deviation: knob("LDEV", 0.15),
        direction_deviation: knob("DDEV", 0.15),
    })
}

pub fn associate(
    memory: &mut Memory,
    method: Method,
    query: &DescribedScan,
    place: &DescribedScan,
) -> Option<(Pose, usize, f64)> {
    const RADIUS: f32 = 0.1;
    match method {
        Method::GlarotGraph => {
            let (alignment, _) =
                memory.graph.associate(&query.keypoints, &place.keypoints, &Compatibility::thesis())?;
            let points = common_points(&query.keypoints, &place.keypoints, &alignment.pose, RADIUS);
            Some((alignment.pose, points, points as f64))
        }
        Method::GlarotHough => {
            let alignment =
                memory.hough.associate(&query.keypoints, &place.keypoints, &HoughParameters::default())?;
            let points = common_points(&query.keypoints, &place.keypoints, &alignment.pose, RADIUS);
            Some((alignment.pose, points, points as f64))
        }
        Method::Improved => {
            let compatibility = Compatibility {
                tolerance: knob("TOL", 0.15),
                orientation: Some(knob("OTOL", 0.5)),
                same_kind: knob("KIND", 1.0) > 0.5,
                most_steps: 2000,
            };
            let (alignment, _) = memory.graph.associate(&query.keypoints, &place.keypoints, &compatibility)?;
            let mut pose = alignment.pose;
            for _ in 0..2 {
                if let Some(better) = refine(&query.keypoints, &place.keypoints, &pose, 0.25) {
                    pose = better.pose;
                }
            }
            let points = common_points(&query.keypoints, &place.keypoints, &pose, knob("RAD", 0.2));
            let both = overlap(&query.points, &place.points, &pose, &OverlapParameters {
                near: knob("NEAR", 0.15), beyond: knob("BEYOND", 0.3), every: 2 });
            let score = match knob("SCORE", 0.0) as i32 {
                0 => both.agreeing as f64 / (both.agreeing + both.contradicting).max(1) as f64 * f64::from(both.share()).sqrt(),
                1 => f64::from(both.agreement()),
                2 => f64::from(both.share()),
                _ => f64::from(both.agreeing) / f64::from((both.agreeing + both.contradicting).max(1)),
            };
            Some((pose, points, score))
        }
    }
}

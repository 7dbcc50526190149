//! The target in a scan (M 3.1.3).

use std::vec::Vec;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{Plane, Return, Target};
use crate::calibration::Laser;
use crate::geometry::Offsets;

/// Points that vote, and planes that they vote on.
const VOTERS: usize = 3000;
const PROPOSALS: usize = 600;
/// A plane is proposed by three points no farther apart than this, m: a target of few points is then found as well.
const NEIGHBOURHOOD: f64 = 6.0;
/// Times that the best proposal is refitted to the points near to it.
const REFITS: usize = 4;
/// Points this near to a plane vote for it, m. The factory's values may be wrong by some centimetres.
const VOTE: f64 = 0.15;
/// Half the thickness of what is cut out, m.
const REACH: f64 = 0.5;
/// A plane is one on which at least this part of the voters lies.
const LEAST: f64 = 0.02;
/// A target's normal rises by at most 45 deg in the frame of the sensor.
const STEEPEST: f64 = core::f64::consts::FRAC_1_SQRT_2;

/// Why no target was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SegmentationError {
    /// There is nothing to look at.
    #[error("the scan has {returns} returns, too few for a plane")]
    TooFew {
        /// Returns in the scan.
        returns: usize,
    },
    /// No plane has enough points.
    #[error("no upright plane stands out: the best has {percent} % of the points")]
    NoPlane {
        /// Share of the best one.
        percent: usize,
    },
}

/// Finds the upright plane with the most points, and cuts out what lies within 0.5 m of it. Where it meets another plane
/// (the ground at its foot), points may belong to either and are left out.
///
/// The votes are drawn at random from `seed`, so that the same scan gives the same target.
///
/// # Errors
/// See [`SegmentationError`].
pub fn segment(lasers: &[Laser], offsets: Offsets, scan: &[Return], seed: u64) -> Result<Target, SegmentationError> {
    let points: Vec<Option<[f64; 3]>> = scan.iter().map(|seen| seen.point(lasers, offsets)).collect();
    let seen: Vec<[f64; 3]> = points.iter().copied().flatten().collect();
    if seen.len() < 100 {
        return Err(SegmentationError::TooFew { returns: seen.len() });
    }
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let draw = |_| seen.get(random.random_range(0..seen.len())).copied();
    let voters: Vec<[f64; 3]> = (0..VOTERS).filter_map(draw).collect();
    let is_upright = |plane: &Plane| plane.normal[2].abs() < STEEPEST;
    let (target, votes) = most_voted(&voters, &mut random, is_upright);
    let target = target.filter(|_| votes as f64 >= LEAST * voters.len() as f64);
    let target = target.ok_or(SegmentationError::NoPlane { percent: 100 * votes / voters.len() })?;
    let rest: Vec<[f64; 3]> = voters.iter().copied().filter(|voter| target.distance_of(*voter).abs() > REACH).collect();
    let (second, votes) = most_voted(&rest, &mut random, |_| true);
    let second = second.filter(|_| votes as f64 >= LEAST * voters.len() as f64);
    let is_on_target = |point: [f64; 3]| {
        target.distance_of(point).abs() <= REACH && second.is_none_or(|plane| plane.distance_of(point).abs() > REACH)
    };
    let of_target = scan.iter().zip(&points).filter(|(_, point)| point.is_some_and(is_on_target));
    Ok(Target { returns: of_target.map(|(seen, _)| *seen).collect(), plane: target })
}

/// The proposal on which most voters lie, refitted to them, and how many they are.
fn most_voted(
    voters: &[[f64; 3]],
    random: &mut ChaCha8Rng,
    is_allowed: impl Fn(&Plane) -> bool,
) -> (Option<Plane>, usize) {
    let votes = |plane: &Plane| voters.iter().filter(|voter| plane.distance_of(**voter).abs() < VOTE).count();
    let mut best = (None, 0);
    for _ in 0..PROPOSALS {
        let Some(plane) = proposal(voters, random).filter(&is_allowed) else { continue };
        let votes = votes(&plane);
        if votes > best.1 {
            best = (Some(plane), votes);
        }
    }
    for _ in 0..REFITS {
        let near = best.0.and_then(|plane: Plane| {
            Plane::fit(voters.iter().copied().filter(|voter| plane.distance_of(*voter).abs() < VOTE))
        });
        best = (near, near.map_or(0, |plane| votes(&plane)));
    }
    best
}

/// The plane through a point and two others of its neighbourhood.
fn proposal(voters: &[[f64; 3]], random: &mut ChaCha8Rng) -> Option<Plane> {
    let first = *voters.get(random.random_range(0..voters.len().max(1)))?;
    let is_near = |voter: &[f64; 3]| {
        let squared: f64 = voter.iter().zip(first).map(|(a, b)| (a - b) * (a - b)).sum();
        squared < NEIGHBOURHOOD * NEIGHBOURHOOD
    };
    let near: Vec<[f64; 3]> = voters.iter().copied().filter(is_near).collect();
    let mut draw = || near.get(random.random_range(0..near.len().max(1))).copied();
    Plane::through([first, draw()?, draw()?])
}

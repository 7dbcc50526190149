//! Whether two scans can both be true if one was taken at a given pose in the frame of the other.

use super::beam_lookup::BeamLookup;
use agv_core::geometry::{Pose, ScanPoint, Transform};
use agv_core::sensing::PointScan;

/// When a return of one scan agrees with another scan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OverlapParameters {
    /// Returns at most this far apart are of the same surface, m.
    pub near: f32,
    /// A beam that passes a return of the other scan by more than this contradicts it, m.
    pub beyond: f32,
    /// Every so many beams are looked at.
    pub every: u8,
}

impl Default for OverlapParameters {
    fn default() -> Self {
        Self { near: 0.1, beyond: 0.2, every: 2 }
    }
}

/// What two scans say of each other: counts of returns of both.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Overlap {
    /// Returns that lie on a surface that the other scan saw.
    pub agreeing: u32,
    /// Returns at places that the other scan saw to be free.
    pub contradicting: u32,
    /// Returns that are hidden from the other sensor.
    pub hidden: u32,
    /// Returns outside the other's field of view, or where it saw nothing.
    pub outside: u32,
}

impl Overlap {
    /// Share of the returns in the field of view that agree; zero if there is none.
    #[must_use]
    pub fn agreement(&self) -> f32 {
        let seen = self.agreeing + self.contradicting + self.hidden;
        if seen == 0 { 0.0 } else { self.agreeing as f32 / seen as f32 }
    }

    /// Share of all returns that agree; zero if there is none.
    #[must_use]
    pub fn share(&self) -> f32 {
        let all = self.agreeing + self.contradicting + self.hidden + self.outside;
        if all == 0 { 0.0 } else { self.agreeing as f32 / all as f32 }
    }

    fn add(self, other: Self) -> Self {
        Self {
            agreeing: self.agreeing + other.agreeing,
            contradicting: self.contradicting + other.contradicting,
            hidden: self.hidden + other.hidden,
            outside: self.outside + other.outside,
        }
    }
}

/// Compares two scans in both directions, if the source was taken at `pose` in the frame of the target. Points must not
/// have been corrected for motion by more than the distances in `parameters`.
#[must_use]
pub fn overlap<const BEAMS: usize>(
    source: &PointScan<BEAMS>,
    target: &PointScan<BEAMS>,
    pose: &Pose,
    parameters: &OverlapParameters,
) -> Overlap {
    one_way(source, target, pose, parameters).add(one_way(target, source, &pose.inverse(), parameters))
}

fn one_way<const BEAMS: usize>(
    source: &PointScan<BEAMS>,
    target: &PointScan<BEAMS>,
    pose: &Pose,
    parameters: &OverlapParameters,
) -> Overlap {
    let transform = Transform::of(pose);
    let lookup = BeamLookup::new(target);
    let mut overlap = Overlap::default();
    let returns = source.points.iter().zip(&source.ranges).step_by(usize::from(parameters.every.max(1)));
    for (point, _) in returns.filter(|(_, range)| **range > 0.0) {
        match judge(&transform.apply(point), &lookup, parameters) {
            Some(Judgement::Agrees) => overlap.agreeing += 1,
            Some(Judgement::Contradicts) => overlap.contradicting += 1,
            Some(Judgement::IsHidden) => overlap.hidden += 1,
            None => overlap.outside += 1,
        }
    }
    overlap
}

enum Judgement {
    Agrees,
    Contradicts,
    IsHidden,
}

/// Beams to each side of a return's direction that may have met the same surface.
const BESIDE: isize = 2;

fn judge(point: &ScanPoint, target: &BeamLookup<'_>, parameters: &OverlapParameters) -> Option<Judgement> {
    let beam = target.towards(point);
    let limit = parameters.near * parameters.near;
    let distance = point.norm();
    let (mut nearest, mut farthest) = (f32::MAX, 0.0_f32);
    for beside in -BESIDE..=BESIDE {
        let Some(other) = target.beam(beam + beside) else { continue };
        if (other.point - point).norm_squared() <= limit {
            return Some(Judgement::Agrees);
        }
        if beside.abs() <= 1 {
            nearest = nearest.min(other.range);
            farthest = farthest.max(other.range);
        }
    }
    if farthest <= 0.0 {
        None
    } else if nearest > distance + parameters.beyond {
        Some(Judgement::Contradicts)
    } else {
        Some(Judgement::IsHidden)
    }
}

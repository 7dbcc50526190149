//! The pose under which the surfaces of two scans coincide: points to lines, iterated.

use super::beam_lookup::BeamLookup;
use agv_core::geometry::{Pose, ScanPoint, Transform};
use agv_core::sensing::{PointScan, PointToLine, ScanAlignment};

/// How scans are aligned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScanAlignmentParameters {
    /// Points further from the surface than this are left out at first, m.
    pub first_reach: f32,
    /// The same at the end, m.
    pub last_reach: f32,
    /// Number of iterations.
    pub iterations: u8,
    /// Every so many beams are looked at.
    pub every: u8,
    /// Standard deviation of a range, m.
    pub range_deviation: f32,
}

impl Default for ScanAlignmentParameters {
    fn default() -> Self {
        Self { first_reach: 0.4, last_reach: 0.1, iterations: 8, every: 2, range_deviation: 0.02 }
    }
}

/// Fewest points that fix a pose.
const FEWEST: u32 = 20;

/// Beams to each side of a point's direction in which its surface is looked for.
const BESIDE: isize = 3;

/// Neighbouring returns further apart than this, m, are not on one surface.
const LONGEST_EDGE: f32 = 0.5;

/// Moves the source scan, which is taken to be at `start` in the frame of the target, to where its points lie on the lines
/// between neighbouring returns of the target. None if too few points find a line, or if they fix no pose.
#[must_use]
pub fn align_scans<const BEAMS: usize>(
    source: &PointScan<BEAMS>,
    target: &PointScan<BEAMS>,
    start: &Pose,
    parameters: &ScanAlignmentParameters,
) -> Option<ScanAlignment> {
    let lookup = BeamLookup::new(target);
    let mut pose = *start;
    let mut outcome = None;
    let iterations = parameters.iterations.max(1);
    for iteration in 0..iterations {
        let share = f32::from(iteration) / f32::from((iterations - 1).max(1));
        let reach = parameters.first_reach + share * (parameters.last_reach - parameters.first_reach);
        let transform = Transform::of(&pose);
        let mut equations = PointToLine::default();
        let (mut squares, mut count) = (0.0, 0);
        let returns = source.points.iter().zip(&source.ranges).step_by(usize::from(parameters.every.max(1)));
        for (point, _) in returns.filter(|(_, range)| **range > 0.0) {
            let moved = transform.apply(point);
            let Some((normal, distance)) = surface(&lookup, &moved, reach) else { continue };
            equations.add(&normal, &(moved - transform.shift()), distance, 1.0);
            squares += f64::from(distance * distance);
            count += 1;
        }
        if count < FEWEST {
            return None;
        }
        pose = equations.step(&pose)?;
        let residual = libm::sqrt(squares / f64::from(count));
        let deviation = residual.max(f64::from(parameters.range_deviation));
        let information = equations.information / (deviation * deviation);
        outcome = Some(ScanAlignment { pose, information, residual, points: count });
    }
    outcome.filter(|found| found.pose.is_finite())
}

/// Normal of the target's surface next to a point, and signed distance of the point from it, m. None if none is within
/// `reach`.
fn surface(lookup: &BeamLookup<'_>, point: &ScanPoint, reach: f32) -> Option<(ScanPoint, f32)> {
    let beam = lookup.towards(point);
    let (mut best, mut nearest) = (reach * reach, None);
    for beside in -BESIDE..=BESIDE {
        if let Some(found) = lookup.beam(beam + beside) {
            let square = (found.point - point).norm_squared();
            if square < best {
                (best, nearest) = (square, Some((beam + beside, found.point)));
            }
        }
    }
    let (beam, nearest) = nearest?;
    let beside = [beam - 1, beam + 1].map(|number| lookup.beam(number).map(|found| found.point));
    let mut best: Option<(f32, ScanPoint)> = None;
    for other in beside.into_iter().flatten() {
        let edge = other - nearest;
        let length = edge.norm();
        if length > 1e-4 && length < LONGEST_EDGE && best.is_none_or(|(shortest, _)| length < shortest) {
            best = Some((length, edge));
        }
    }
    // The direction of a surface is steadier over two edges than over one.
    let (length, edge) = match beside {
        [Some(before), Some(after)] if (after - before).norm() < LONGEST_EDGE => {
            ((after - before).norm(), after - before)
        }
        _ => best?,
    };
    if length <= 1e-4 {
        return None;
    }
    let normal = ScanPoint::new(-edge.y, edge.x) / length;
    let distance = normal.dot(&(point - nearest));
    Some((normal, distance))
}

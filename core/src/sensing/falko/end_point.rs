//! Where a face that stands in front of something ends.
//!
//! The last return of a face is not its end: the end lies somewhere between the points where this beam and the next one
//! meet the face's line, so half a beam beyond on average, uniformly distributed. A return of the background on the
//! other side of the jump is where a shadow begins; it moves with the sensor and marks nothing.

use super::parameters::{EndPointParameters, Parameters};
use super::runs::{Beams, Runs};
use crate::geometry::ScanPoint;
use crate::sensing::line::{Line, Moments, largest_variance};
use crate::sensing::{Keypoint, KeypointKind, PointScan};

/// To which side of its last beam a face ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Ends {
    /// Its beams have smaller indices than the background's.
    After,
    /// Its beams have larger indices than the background's.
    Before,
}

/// Farthest number of absent beams over which the background is looked for; beyond it there is none.
const FARTHEST_BACKGROUND: usize = 8;

/// Points of a face before its line is trusted to tell whether the next point lies on it.
const TRUSTED: f32 = 5.0;

/// The trusted line is fitted anew each time the face has grown by this factor.
const GROWTH: f32 = 1.25;

/// Finds the ends of the faces of a scan and gives each to `keep`.
pub(super) fn find<const BEAMS: usize>(
    scan: &PointScan<BEAMS>,
    runs: &Runs<BEAMS>,
    parameters: &Parameters,
    wanted: &EndPointParameters,
    crosses_seam: bool,
    mut keep: impl FnMut(Keypoint),
) {
    let beams = Beams { ranges: &scan.ranges, points: &scan.points, crosses_seam };
    let lengths = runs.lengths(beams.ranges.len());
    for (index, (&range, (before, after))) in beams.ranges.iter().zip(lengths).enumerate() {
        // Most beams are inside a face.
        let is_inside = before > 0 && after > 0;
        let is_near = range > 0.0 && range <= parameters.farthest;
        if is_inside || !is_near {
            continue;
        }
        for (ends, own, back) in [(Ends::After, after, before), (Ends::Before, before, after)] {
            let back = usize::from(back);
            if own > 0 || back + 1 < usize::from(wanted.points) {
                continue;
            }
            let away = |steps: usize| match ends {
                Ends::After => beams.forth(index, steps),
                Ends::Before => beams.back(index, steps),
            };
            // Where the field of view ends, the face need not.
            if away(1).is_none() {
                continue;
            }
            let background = (1..=FARTHEST_BACKGROUND)
                .find_map(|steps| away(steps).and_then(|other| Some((steps, other, beams.range(other)?))));
            if background.is_some_and(|(_, _, background)| background <= range) {
                continue;
            }
            let background = background.map(|(steps, other, _)| (steps, other));
            if let Some(keypoint) = end_of_face(scan, &beams, index, ends, back, background, parameters, wanted) {
                keep(keypoint);
            }
        }
    }
}

#[allow(clippy::too_many_arguments, reason = "one face, seen from the loop above")]
fn end_of_face<const BEAMS: usize>(
    scan: &PointScan<BEAMS>,
    beams: &Beams<'_>,
    index: usize,
    ends: Ends,
    length: usize,
    background: Option<(usize, usize)>,
    parameters: &Parameters,
    wanted: &EndPointParameters,
) -> Option<Keypoint> {
    let last = *scan.points.get(index)?;
    let range = *scan.ranges.get(index)?;
    let ray = last / last.norm().max(1e-6);
    let (line, extent) = face_line(scan, beams, index, ends, length, wanted)?;
    let normal = line.normal();
    // Distance of the sensor from the line decides how far apart the beams meet it.
    let distance = libm::fabsf(normal.dot(&(last + line.centroid)));
    let slant = libm::fabsf(normal.dot(&ray));
    if extent < wanted.shortest || line.mean_square() > wanted.residual * wanted.residual || slant < 0.05 {
        return None;
    }
    let spacing = range * range * scan.bearing_step / distance.max(1e-3);
    if spacing > wanted.spacing {
        return None;
    }
    let offset = normal.dot(&line.centroid);
    if libm::fabsf(offset) > 3.0 * wanted.residual {
        return None;
    }
    let mut steps = 1;
    if let Some((background_steps, other)) = background {
        steps = background_steps;
        let beyond = *scan.points.get(other)?;
        if hides_too_little(&line, last, beyond, wanted.depth) {
            return None;
        }
    }
    let gap = spacing * steps as f32;
    if gap > 2.0 * wanted.spacing {
        return None;
    }
    // Where the last beam meets the line: the range's own error drops out.
    let foot = ray * (offset / normal.dot(&ray));
    let outwards = if line.along.dot(&line.centroid) > 0.0 { -line.along } else { line.along };
    let relative = foot + outwards * (0.5 * gap);

    let across = line.variance_at(relative, ray, parameters.range_deviation * parameters.range_deviation);
    // An error across the line moves the foot along the beam.
    let along_beam = across / (slant * slant);
    let along_face = gap * gap / 12.0;
    let floor = parameters.deviation_floor * parameters.deviation_floor;
    let covariance = [
        along_beam * ray.x * ray.x + along_face * outwards.x * outwards.x + floor,
        along_beam * ray.x * ray.y + along_face * outwards.x * outwards.y,
        along_beam * ray.y * ray.y + along_face * outwards.y * outwards.y + floor,
    ];
    if largest_variance(covariance) > wanted.spacing * wanted.spacing {
        return None;
    }
    Some(Keypoint {
        kind: KeypointKind::EndPoint,
        beam: index as u16,
        position: last + relative,
        covariance,
        orientation: libm::atan2f(-outwards.y, -outwards.x),
        radius: extent,
        score: 0.0,
    })
}

/// Whether what is seen beside the face lies less than `depth` (m) behind the line of the face.
#[inline(always)]
fn hides_too_little(line: &Line, last: ScanPoint, beyond: ScanPoint, depth: f32) -> bool {
    let normal = line.normal();
    let direction = beyond / beyond.norm().max(1e-6);
    let approach = normal.dot(&direction);
    let crossing = normal.dot(&(last + line.centroid)) / approach;
    // A line that the background's beam does not meet lies behind the sensor or runs along the beam.
    crossing > 0.0 && beyond.norm() - crossing < depth
}

/// The line through the face from its last beam inwards, relative to the last return, and how far it goes, m.
fn face_line<const BEAMS: usize>(
    scan: &PointScan<BEAMS>,
    beams: &Beams<'_>,
    index: usize,
    ends: Ends,
    length: usize,
    wanted: &EndPointParameters,
) -> Option<(Line, f32)> {
    let last = *scan.points.get(index)?;
    let mut moments = Moments::default();
    let (mut trusted, mut renewal) = (None::<Line>, TRUSTED);
    let mut extent = 0.0_f32;
    let farthest = 3.0 * wanted.residual;
    for steps in 0..=length {
        let inwards = match ends {
            Ends::After => beams.back(index, steps),
            Ends::Before => beams.forth(index, steps),
        };
        let Some(inner) = inwards else { break };
        if beams.range(inner).is_none() {
            continue;
        }
        let relative = *scan.points.get(inner)? - last;
        let reach = relative.norm();
        if reach > wanted.length {
            break;
        }
        if moments.count >= renewal {
            trusted = moments.line();
            renewal = GROWTH * moments.count;
        }
        if let Some(line) = &trusted {
            // The face bends here: what lies behind is another one.
            if libm::fabsf(line.normal().dot(&(relative - line.centroid))) > farthest {
                break;
            }
        }
        moments.add(relative);
        extent = extent.max(reach);
    }
    if moments.count < f32::from(wanted.points) {
        return None;
    }
    Some((moments.line()?, extent))
}

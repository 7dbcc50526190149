//! Where a face that stands in front of something ends.
//!
//! The last return of a face is not its end: the end lies somewhere between the points where this beam and the next one
//! meet the face's line, so half a beam beyond on average, uniformly distributed. A return of the background on the
//! other side of the jump is where a shadow begins; it moves with the sensor and marks nothing.

use super::parameters::{EndPointParameters, Parameters};
use super::runs::{Beams, Lengths};
use crate::geometry::ScanPoint;
use crate::sensing::line::{Line, Moments, largest_variance};
use crate::sensing::{Keypoint, KeypointKind};

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

/// The faces of a scan, and what is asked of their ends.
#[derive(Clone, Copy, Debug)]
pub(super) struct Faces<'a> {
    pub beams: Beams<'a>,
    /// Angle between neighbouring beams, rad.
    pub bearing_step: f32,
    pub runs: Lengths<'a>,
    pub parameters: &'a Parameters,
    pub wanted: &'a EndPointParameters,
}

impl Faces<'_> {
    /// Finds the ends of the faces and gives each to `keep`.
    pub(super) fn find_ends(&self, mut keep: impl FnMut(Keypoint)) {
        let least = self.wanted.points.saturating_sub(1);
        let count = self.runs.before.len();
        let mut index = 0;
        // Each turn moves on by at least one beam.
        for _ in 0..count {
            let (Some(&before), Some(&after)) = (self.runs.before.get(index), self.runs.after.get(index)) else {
                break;
            };
            if after == 0 && before >= least {
                self.end(index, Ends::After, usize::from(before)).into_iter().for_each(&mut keep);
            }
            if before == 0 && after >= least {
                self.end(index, Ends::Before, usize::from(after)).into_iter().for_each(&mut keep);
            }
            // All beams up to the last of a surface are inside it.
            index += usize::from(after.max(1));
        }
    }

    /// The end of a face at its last beam, which has `length` beams of it on the other side. None if nothing says where it ends.
    fn end(&self, index: usize, ends: Ends, length: usize) -> Option<Keypoint> {
        let Self { beams, parameters, wanted, .. } = self;
        let range = beams.range(index).filter(|range| *range <= parameters.farthest)?;
        let away = |steps: usize| match ends {
            Ends::After => beams.forth(index, steps),
            Ends::Before => beams.back(index, steps),
        };
        // Where the field of view ends, the face need not.
        away(1)?;
        let background = (1..=FARTHEST_BACKGROUND)
            .find_map(|steps| away(steps).and_then(|other| Some((steps, other, beams.range(other)?))));
        if background.is_some_and(|(_, _, background)| background <= range) {
            return None;
        }
        let (line, extent) = face_line(beams, index, ends, length, wanted)?;
        let background = background.map(|(steps, other, _)| (steps, other));
        self.end_of_line(index, range, &line, extent, background)
    }

    /// Covariance of an end point, m^2, of a unit vector along the beam and one along the face, each with its variance, m^2.
    #[inline(always)]
    fn covariance(&self, beam: (ScanPoint, f32), face: (ScanPoint, f32)) -> [f32; 3] {
        let ((ray, along_beam), (outwards, along_face)) = (beam, face);
        let floor = self.parameters.deviation_floor * self.parameters.deviation_floor;
        [
            along_beam * ray.x * ray.x + along_face * outwards.x * outwards.x + floor,
            along_beam * ray.x * ray.y + along_face * outwards.x * outwards.y,
            along_beam * ray.y * ray.y + along_face * outwards.y * outwards.y + floor,
        ]
    }

    /// The same, if the face lies along a line and goes on for `extent` (m), and some beams on something is seen behind it.
    fn end_of_line(
        &self,
        index: usize,
        range: f32,
        line: &Line,
        extent: f32,
        background: Option<(usize, usize)>,
    ) -> Option<Keypoint> {
        let Self { beams, parameters, wanted, .. } = self;
        let last = *beams.points.get(index)?;
        let ray = last / last.norm().max(1e-6);
        let normal = line.normal();
        // Distance of the sensor from the line decides how far apart the beams meet it.
        let distance = libm::fabsf(normal.dot(&(last + line.centroid)));
        let slant = libm::fabsf(normal.dot(&ray));
        if extent < wanted.shortest || line.mean_square() > wanted.residual * wanted.residual || slant < 0.05 {
            return None;
        }
        let spacing = range * range * self.bearing_step / distance.max(1e-3);
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
            let beyond = *beams.points.get(other)?;
            if hides_too_little(line, last, beyond, wanted.depth) {
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
        let covariance = self.covariance((ray, across / (slant * slant)), (outwards, gap * gap / 12.0));
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
fn face_line(
    beams: &Beams<'_>,
    index: usize,
    ends: Ends,
    length: usize,
    wanted: &EndPointParameters,
) -> Option<(Line, f32)> {
    let last = *beams.points.get(index)?;
    let mut moments = Moments::default();
    let (mut trusted, mut renewal) = (None::<Line>, TRUSTED);
    let mut extent = 0.0_f32;
    let farthest = 3.0 * wanted.residual;
    let mut inner = Some(index);
    for _ in 0..=length {
        let Some((point, range)) = inner.and_then(|inner| beams.points.get(inner).zip(beams.ranges.get(inner))) else {
            break;
        };
        if *range > 0.0 {
            let relative = point - last;
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
        inner = inner.and_then(|inner| match ends {
            Ends::After => beams.back(inner, 1),
            Ends::Before => beams.forth(inner, 1),
        });
    }
    if moments.count < f32::from(wanted.points) {
        return None;
    }
    Some((moments.line()?, extent))
}

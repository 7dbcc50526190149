//! A scan as pieces of surface, looked up by direction: what later scans are aligned to.

use serde::{Deserialize, Serialize};

use super::PointView;
use super::line::Moments;
use crate::geometry::{Pose, ScanPoint, Transform, sector};

/// A piece of surface.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Surface {
    /// A point of it, m; infinitely far where nothing was seen.
    pub point: ScanPoint,
    /// Its unit normal.
    pub normal: ScanPoint,
}

impl Surface {
    const NONE: Self = Self { point: ScanPoint::new(f32::INFINITY, f32::INFINITY), normal: ScanPoint::new(0.0, 0.0) };
    /// At the sensor, with no normal. It fixes no pose, and is zeros: other values would be copied into a board's memory at the start by
    /// way of its stack.
    const UNSET: Self = Self { point: ScanPoint::new(0.0, 0.0), normal: ScanPoint::new(0.0, 0.0) };
}

/// How pieces of surface are found.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SurfaceParameters {
    /// Points within this radius are of one piece, m.
    pub radius: f32,
    /// What is added to the radius for each metre of distance.
    pub growth: f32,
    /// Largest root mean square distance of the points from the piece, m.
    pub residual: f32,
}

impl Default for SurfaceParameters {
    fn default() -> Self {
        Self { radius: 0.12, growth: 0.02, residual: 0.015 }
    }
}

/// Beams to each side that are looked at for one piece.
const BESIDE: usize = 12;

/// Fewest points of a piece.
const FEWEST: f32 = 4.0;

/// The surfaces around a sensor in `DIRECTIONS` equal sectors, the nearest in each.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct SurfaceScan<const DIRECTIONS: usize> {
    #[serde(with = "crate::arrays")]
    surfaces: [Surface; DIRECTIONS],
}

impl<const DIRECTIONS: usize> SurfaceScan<DIRECTIONS> {
    /// Nothing was seen.
    #[must_use]
    #[inline(always)]
    pub const fn new() -> Self {
        Self { surfaces: [Surface::UNSET; DIRECTIONS] }
    }

    /// Replaces the content by the surfaces of a scan, seen from `place` in the frame of its points.
    pub fn set(&mut self, scan: PointView<'_>, place: &Pose, parameters: &SurfaceParameters) {
        self.surfaces.fill(Surface::NONE);
        let transform = Transform::of(&place.inverse());
        for index in 0..scan.ranges.len() {
            let Some(surface) = surface_at(scan, index, parameters) else { continue };
            let turned = transform.apply(&surface.normal) - transform.shift();
            let seen = Surface { point: transform.apply(&surface.point), normal: turned };
            let direction = self.direction(&seen.point, 0);
            if let Some(slot) = self.surfaces.get_mut(direction)
                && slot.point.norm_squared() > seen.point.norm_squared()
            {
                *slot = seen;
            }
        }
    }

    /// The surface nearest to `point` among those that are seen up to `beside` sectors from it, with the square of its
    /// distance, m^2.
    pub(super) fn nearest<'a>(&'a self, point: &ScanPoint, beside: usize) -> Option<(&'a Surface, f32)> {
        let start = self.direction(point, DIRECTIONS - beside);
        let end = start + 2 * beside + 1;
        let (mut best, mut nearest) = (None, f32::INFINITY);
        let mut look = |surfaces: &'a [Surface]| {
            for surface in surfaces {
                let square = (surface.point - point).norm_squared();
                if square < nearest {
                    (best, nearest) = (Some(surface), square);
                }
            }
        };
        look(self.surfaces.get(start..end.min(DIRECTIONS))?);
        look(self.surfaces.get(..end.saturating_sub(DIRECTIONS))?);
        best.map(|surface| (surface, nearest))
    }

    /// The sector in which a point lies, and `turn` sectors on.
    fn direction(&self, point: &ScanPoint, turn: usize) -> usize {
        let sector = sector(point, DIRECTIONS) + turn;
        if sector >= DIRECTIONS { sector - DIRECTIONS } else { sector }
    }
}

impl<const DIRECTIONS: usize> Default for SurfaceScan<DIRECTIONS> {
    fn default() -> Self {
        Self::new()
    }
}

/// The surface through a return and its neighbours. None if they are too few or not straight.
fn surface_at(scan: PointView<'_>, index: usize, parameters: &SurfaceParameters) -> Option<Surface> {
    let centre = *scan.points.get(index)?;
    let range = *scan.ranges.get(index)?;
    if range <= 0.0 {
        return None;
    }
    let radius = parameters.radius + parameters.growth * range;
    let count = scan.ranges.len();
    let mut moments = Moments::default();
    for step in 0..=2 * BESIDE {
        let beam = index + count + step;
        let Some(beam) = beam.checked_sub(BESIDE) else { continue };
        let (beam, is_inside) = if beam >= 2 * count {
            (beam - 2 * count, scan.is_full_circle)
        } else if beam >= count {
            (beam - count, true)
        } else {
            (beam, scan.is_full_circle)
        };
        let (Some(point), Some(range)) = (scan.points.get(beam), scan.ranges.get(beam)) else { continue };
        let relative = point - centre;
        if is_inside && *range > 0.0 && relative.norm_squared() <= radius * radius {
            moments.add(relative);
        }
    }
    if moments.count < FEWEST {
        return None;
    }
    let line = moments.line().filter(|line| line.mean_square() <= parameters.residual * parameters.residual)?;
    let normal = line.normal();
    // The return, moved onto the line.
    Some(Surface { point: centre + normal * normal.dot(&line.centroid), normal })
}

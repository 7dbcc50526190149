//! Points of surfaces in a scan: evenly along the contours, whatever the angle between two beams is, and only those that
//! say where their surface is.
//!
//! A lone beam far down a wall that it grazes hits another place of it in each scan, as far ahead of the vehicle as before: taken for
//! a point of its own it says that the vehicle stands. So do near beams closer together than their noise, which look like corners.

use heapless::Vec;

use super::SurfacePoint;
use crate::geometry::ScanPoint;
use crate::order::Evenly;
use crate::sensing::{Moments, PointView};

/// Returns further away are not used, m.
const FARTHEST: f32 = 30.0;

/// Distance along the contours between two points, m.
const SPACING: f32 = 0.05;

/// Returns within this distance are of one piece, m.
const RADIUS: f32 = 0.15;

/// Returns to each side that are looked at.
const BESIDE: usize = 12;

/// A piece is flat if the scatter across it is less than this share of that along it,
const FLAT_SHARE: f32 = 0.04;

/// or if its returns lie within this of a line, root mean square, m,
const FLAT_ACROSS: f32 = 0.02;

/// and reach this far along it, root mean square, m.
const FLAT_ALONG: f32 = 0.04;

/// Where beams are far apart, neighbours are of one surface if they are nearer than this, m,
const THIN_GAP: f32 = 3.0;

/// and all of them are within this of a line, m.
const THIN_ACROSS: f32 = 0.05;

/// A return that stands alone is this much nearer than both neighbours, m.
const ALONE: f32 = 0.1;

/// Replaces `found` by the points of surfaces of a scan, in the frame of the scan's points. If there are more than there is room for, they are
/// further apart.
pub fn find_surface_points<const POINTS: usize>(scan: PointView<'_>, found: &mut Vec<SurfacePoint, POINTS>) {
    found.clear();
    let beams = Beams(scan);
    let mut evenly = Evenly::new(POINTS, Walk::new(beams).count());
    for index in Walk::new(beams) {
        if evenly.takes()
            && let Some(point) = beams.surface_point(index)
        {
            // No more are taken than there is room for.
            let _ = found.push(point);
        }
    }
}

/// The beams that are looked at, in order.
struct Walk<'a> {
    beams: Beams<'a>,
    next: usize,
    last: Option<ScanPoint>,
}

impl<'a> Walk<'a> {
    const fn new(beams: Beams<'a>) -> Self {
        Self { beams, next: 0, last: None }
    }
}

impl Iterator for Walk<'_> {
    type Item = usize;

    fn next(&mut self) -> Option<usize> {
        while self.next < self.beams.0.ranges.len() {
            let index = self.next;
            self.next += 1;
            let Some((point, _)) = self.beams.at(index) else { continue };
            if self.last.is_none_or(|last| (point - last).norm_squared() >= SPACING * SPACING) {
                self.last = Some(point);
                return Some(index);
            }
        }
        None
    }
}

/// The returns of a scan by beam.
#[derive(Clone, Copy)]
struct Beams<'a>(PointView<'a>);

/// The returns near another one.
struct Piece {
    moments: Moments,
    before: usize,
    after: usize,
}

impl Beams<'_> {
    /// A return that is used, and its range.
    fn at(&self, index: usize) -> Option<(ScanPoint, f32)> {
        let range = *self.0.ranges.get(index)?;
        (range > 0.0 && range <= FARTHEST).then_some((*self.0.points.get(index)?, range))
    }

    /// The return so many beams further on, or back; around the end if the scan is a full circle.
    fn beside(&self, index: usize, steps: usize, is_before: bool) -> Option<(ScanPoint, f32)> {
        let count = self.0.ranges.len();
        if steps >= count {
            return None;
        }
        let beam = if is_before { (index + count) - steps } else { index + steps };
        let is_around = if is_before { beam < count } else { beam >= count };
        if is_around && !self.0.is_full_circle {
            return None;
        }
        self.at(if beam >= count { beam - count } else { beam })
    }

    fn surface_point(&self, index: usize) -> Option<SurfacePoint> {
        let (centre, range) = self.at(index)?;
        let piece = self.piece(index, centre, range);
        let facing = |normal: ScanPoint| if normal.dot(&centre) > 0.0 { -normal } else { normal };
        if piece.before > 0 && piece.after > 0 {
            let line = piece.moments.line()?;
            let is_flat = line.squares < FLAT_SHARE * line.spread
                || (line.mean_square() < FLAT_ACROSS * FLAT_ACROSS
                    && line.spread > FLAT_ALONG * FLAT_ALONG * line.count);
            if !is_flat {
                return Some(SurfacePoint { position: centre, normal: ScanPoint::zeros() });
            }
            // Onto the line: its noise is less than that of one return.
            let normal = facing(line.normal());
            return Some(SurfacePoint { position: centre + normal * normal.dot(&line.centroid), normal });
        }
        if let Some(normal) = self.thin_normal(index, centre) {
            return Some(SurfacePoint { position: centre, normal: facing(normal) });
        }
        let is_alone = piece.before == 0
            && piece.after == 0
            && [true, false]
                .into_iter()
                .all(|is_before| self.beside(index, 1, is_before).is_some_and(|(_, beside)| beside > range + ALONE));
        is_alone.then_some(SurfacePoint { position: centre, normal: ScanPoint::zeros() })
    }

    /// The returns near one, so many beams apart that those looked at reach as far as the piece does.
    fn piece(&self, index: usize, centre: ScanPoint, range: f32) -> Piece {
        let reach = range * self.0.bearing_step * BESIDE as f32;
        let stride = if reach > 0.0 { ((RADIUS / reach) as usize).clamp(1, self.0.ranges.len().max(1)) } else { 1 };
        let mut moments = Moments::default();
        moments.add(ScanPoint::zeros());
        let mut side = |is_before: bool| {
            let mut count = 0;
            for step in 1..=BESIDE {
                let Some((point, _)) = self.beside(index, step * stride, is_before) else { continue };
                let relative = point - centre;
                if relative.norm_squared() > RADIUS * RADIUS {
                    break;
                }
                moments.add(relative);
                count += 1;
            }
            count
        };
        let (before, after) = (side(true), side(false));
        Piece { moments, before, after }
    }

    /// The normal of a surface on which beams are far apart: of five in a row, or else of three.
    fn thin_normal(&self, index: usize, centre: ScanPoint) -> Option<ScanPoint> {
        [2, 1].into_iter().find_map(|beside| {
            let mut relatives = [ScanPoint::zeros(); 4];
            let mut moments = Moments::default();
            moments.add(ScanPoint::zeros());
            for (is_before, kept) in [true, false].into_iter().zip(relatives.chunks_mut(2)) {
                let mut last = centre;
                for (step, kept) in (1..=beside).zip(kept) {
                    let (point, _) = self.beside(index, step, is_before)?;
                    if (point - last).norm_squared() > THIN_GAP * THIN_GAP {
                        return None;
                    }
                    *kept = point - centre;
                    moments.add(*kept);
                    last = point;
                }
            }
            let line = moments.line()?;
            let normal = line.normal();
            let is_on = |relative: &ScanPoint| libm::fabsf(normal.dot(&(relative - line.centroid))) <= THIN_ACROSS;
            // What was not looked at stayed at the centre.
            relatives.iter().all(is_on).then_some(normal)
        })
    }
}

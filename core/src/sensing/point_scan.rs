//! A scan as points, organised by beam.

use heapless::Vec;

use crate::geometry::ScanPoint;
use crate::measurement::Scan;

/// The points of a scan, organised by beam, with room for `BEAMS` beams.
#[derive(Clone, Debug, Default)]
pub struct PointScan<const BEAMS: usize> {
    /// Position of each beam's return, m; the origin where the return is absent.
    pub points: Vec<ScanPoint, BEAMS>,
    /// Measured range of each beam, m; zero where the return is absent.
    pub ranges: Vec<f32, BEAMS>,
    /// Direction of the first beam in S, rad.
    pub first_bearing: f32,
    /// Angle between neighbouring beams, rad, positive.
    pub bearing_step: f32,
    /// Whether beams follow one another clockwise.
    pub is_clockwise: bool,
    /// Whether the last beam and the first one are neighbours.
    pub is_full_circle: bool,
}

/// A [`PointScan`] of any capacity.
#[derive(Clone, Copy, Debug)]
pub struct PointView<'a> {
    /// See [`PointScan::points`].
    pub points: &'a [ScanPoint],
    /// See [`PointScan::ranges`].
    pub ranges: &'a [f32],
    /// See [`PointScan::bearing_step`].
    pub bearing_step: f32,
    /// See [`PointScan::is_full_circle`].
    pub is_full_circle: bool,
}

impl<const BEAMS: usize> PointScan<BEAMS> {
    /// An empty scan.
    #[must_use]
    #[inline(always)]
    pub const fn new() -> Self {
        Self {
            points: Vec::new(),
            ranges: Vec::new(),
            first_bearing: 0.0,
            bearing_step: 0.0,
            is_clockwise: false,
            is_full_circle: false,
        }
    }

    /// The points without their capacity.
    #[must_use]
    #[inline]
    pub fn view(&self) -> PointView<'_> {
        PointView {
            points: &self.points,
            ranges: &self.ranges,
            bearing_step: self.bearing_step,
            is_full_circle: self.is_full_circle,
        }
    }

    /// How many beams of the scan there are for each one that is kept: 1 if there is room for all of them.
    #[must_use]
    pub fn stride(scan: &Scan) -> usize {
        scan.ranges.len().div_ceil(if BEAMS > 0 { BEAMS } else { 1 }).max(1)
    }

    /// Replaces the content by the points of `scan` in S, as if all beams were simultaneous. Ranges that are not
    /// finite or lie outside `nearest..=farthest` (m) count as absent. Of a scan with more beams than there is room for, each
    /// [`stride`](Self::stride)th is kept.
    pub fn set(&mut self, scan: &Scan, nearest: f32, farthest: f32) {
        self.first_bearing = scan.first_bearing as f32;
        let stride = Self::stride(scan);
        let step = scan.bearing_step * stride as f64;
        self.bearing_step = libm::fabs(step) as f32;
        self.is_clockwise = scan.bearing_step < 0.0;
        self.is_full_circle = scan.is_full_circle();
        let (step_sine, step_cosine) = libm::sincos(step);
        let (mut sine, mut cosine) = libm::sincos(scan.first_bearing);
        let count = scan.ranges.len().div_ceil(stride).min(BEAMS);
        // There is room for so many.
        let _ = self.points.resize(count, ScanPoint::zeros());
        let _ = self.ranges.resize(count, 0.0);
        let beams = self.points.iter_mut().zip(&mut self.ranges).zip(scan.ranges.iter().step_by(stride));
        for ((point, kept), &range) in beams {
            let range = if range >= nearest && range <= farthest && range > 0.0 { range } else { 0.0 };
            *point = ScanPoint::new(range * cosine as f32, range * sine as f32);
            *kept = range;
            (sine, cosine) = (sine * step_cosine + cosine * step_sine, cosine * step_cosine - sine * step_sine);
        }
    }
}

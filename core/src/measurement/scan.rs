//! One revolution, or one sweep, of a planar laser.

use core::f64::consts::TAU;

use serde::{Deserialize, Serialize};

use super::{LaserId, Time};
use crate::geometry::Point;

/// Ranges of one sweep. Beam `i` was measured at `start + i * beam_interval` in the direction
/// `first_bearing + i * bearing_step` of S, from wherever S was then: motion is not corrected.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Scan<'a> {
    /// Which laser has measured it.
    pub laser: LaserId,
    /// When the first beam was measured.
    pub start: Time,
    /// Time between neighbouring beams, s; zero if all beams are simultaneous.
    pub beam_interval: f64,
    /// Direction of the first beam in S, rad.
    pub first_bearing: f64,
    /// Angle between neighbouring beams, rad, positive counter-clockwise.
    pub bearing_step: f64,
    /// Range of each beam, m. Zero, negative, infinite and NaN ranges are absent returns.
    pub ranges: &'a [f32],
    /// Strength of each return in the device's own unit, or empty if the device reports none.
    pub intensities: &'a [u16],
}

/// A scan without its beams.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ScanHead {
    /// See [`Scan::laser`].
    pub laser: LaserId,
    /// See [`Scan::start`].
    pub start: Time,
    /// See [`Scan::beam_interval`], s.
    pub beam_interval: f64,
    /// See [`Scan::first_bearing`], rad.
    pub first_bearing: f64,
    /// See [`Scan::bearing_step`], rad.
    pub bearing_step: f64,
}

impl ScanHead {
    /// The scan with these beams.
    #[must_use]
    pub const fn scan<'a>(&self, ranges: &'a [f32], intensities: &'a [u16]) -> Scan<'a> {
        let Self { laser, start, beam_interval, first_bearing, bearing_step } = *self;
        Scan { laser, start, beam_interval, first_bearing, bearing_step, ranges, intensities }
    }
}

impl Scan<'_> {
    /// The scan without its beams.
    #[must_use]
    pub const fn head(&self) -> ScanHead {
        let Self { laser, start, beam_interval, first_bearing, bearing_step, .. } = *self;
        ScanHead { laser, start, beam_interval, first_bearing, bearing_step }
    }

    /// Direction of beam `index` in S, rad, not wrapped.
    #[must_use]
    pub fn bearing(&self, index: usize) -> f64 {
        self.first_bearing + index as f64 * self.bearing_step
    }

    /// When beam `index` was measured.
    #[must_use]
    pub fn beam_time(&self, index: usize) -> Time {
        self.start.offset(index as f64 * self.beam_interval)
    }

    /// When the last beam was measured.
    #[must_use]
    pub fn end(&self) -> Time {
        self.beam_time(self.ranges.len().saturating_sub(1))
    }

    /// Whether all beams that pass a place in S within so many m and so many rad end further away than it, by `behind`, m, at least. A
    /// beam without a return says nothing of what it has passed.
    #[must_use]
    pub fn passes(&self, place: &Point, (beside, turn): (f64, f64), behind: f64) -> bool {
        let range = libm::hypot(place.x, place.y);
        let step = libm::fabs(self.bearing_step);
        if range <= 0.0 || step <= 0.0 {
            return false;
        }
        let reach = beside / range + turn;
        let from_first = (libm::atan2(place.y, place.x) - self.first_bearing) * libm::copysign(1.0, self.bearing_step);
        let beams = libm::ceil(2.0 * reach / step) as usize + 1;
        let whole = libm::round(TAU / step) as usize;
        (0..beams.min(self.ranges.len())).all(|beam| {
            let angle = (from_first - reach + beam as f64 * step) % TAU;
            let angle = if angle < 0.0 { angle + TAU } else { angle };
            // Past the last beam of a whole turn is the first one.
            let end = (libm::round(angle / step) as usize).checked_rem(whole).and_then(|index| self.ranges.get(index));
            end.is_some_and(|end| end.is_finite() && *end > 0.0 && f64::from(*end) > range + behind)
        })
    }

    /// Whether the last beam and the first one are neighbours, as in a full revolution.
    #[must_use]
    pub fn is_full_circle(&self) -> bool {
        let gap = TAU - libm::fabs(self.bearing_step) * self.ranges.len() as f64;
        libm::fabs(gap) < 0.5 * libm::fabs(self.bearing_step)
    }
}

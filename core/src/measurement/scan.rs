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

    /// The beam whose direction is nearest to that of a place in S; none if no beam looks there.
    #[must_use]
    pub fn beam_toward(&self, place: &Point) -> Option<usize> {
        let step = libm::fabs(self.bearing_step);
        if step <= 0.0 {
            return None;
        }
        let index = beam_at(self.angle_to(place), step);
        Some(if index < beams_of_turn(step) { index } else { 0 }).filter(|index| *index < self.ranges.len())
    }

    /// Angle from the first beam to a place in S, rad, in the sense in which the beams follow each other.
    fn angle_to(&self, place: &Point) -> f64 {
        (libm::atan2(place.y, place.x) - self.first_bearing) * libm::copysign(1.0, self.bearing_step)
    }

    /// Where beams end that pass a place in S within so many m and so many rad: the nearest and the farthest range, m. None if one of
    /// them has no return, which says nothing of what it has passed, or none is there.
    #[must_use]
    pub fn ends_toward(&self, place: &Point, (beside, turn): (f64, f64)) -> Option<(f64, f64)> {
        let range = libm::hypot(place.x, place.y);
        let step = libm::fabs(self.bearing_step);
        if range <= 0.0 || step <= 0.0 {
            return None;
        }
        let reach = beside / range + turn;
        let beams = (libm::ceil(2.0 * reach / step) as usize).saturating_add(1);
        let whole = beams_of_turn(step);
        let mut index = beam_at(self.angle_to(place) - reach, step);
        let mut ends = (f32::INFINITY, 0.0_f32);
        for _ in 0..beams.min(self.ranges.len()) {
            // Past the last beam of a whole turn is the first one.
            index = if index >= whole { 0 } else { index };
            let end = *self.ranges.get(index)?;
            if !(end > 0.0 && end < f32::INFINITY) {
                return None;
            }
            ends = (ends.0.min(end), ends.1.max(end));
            index = index.saturating_add(1);
        }
        Some((f64::from(ends.0), f64::from(ends.1)))
    }

    /// Whether all beams that pass a place in S within so many m and so many rad end further away than it, by `behind`, m, at least. A
    /// beam without a return says nothing of what it has passed.
    #[must_use]
    pub fn passes(&self, place: &Point, around: (f64, f64), behind: f64) -> bool {
        let range = libm::hypot(place.x, place.y);
        self.ends_toward(place, around).is_some_and(|(nearest, _)| nearest > range + behind)
    }

    /// Whether the last beam and the first one are neighbours, as in a full revolution.
    #[must_use]
    pub fn is_full_circle(&self) -> bool {
        let gap = TAU - libm::fabs(self.bearing_step) * self.ranges.len() as f64;
        libm::fabs(gap) < 0.5 * libm::fabs(self.bearing_step)
    }
}

/// The number of a beam at an angle from the first one, or the number of beams of a whole turn, which is that of the first one again.
fn beam_at(from_first: f64, step: f64) -> usize {
    let angle = from_first % TAU;
    let angle = if angle < 0.0 { angle + TAU } else { angle };
    libm::round(angle / step) as usize
}

/// Beams of a whole turn.
fn beams_of_turn(step: f64) -> usize {
    libm::round(TAU / step) as usize
}

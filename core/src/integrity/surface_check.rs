//! Whether the surfaces around the laser stay where they are while it moves as the odometry says.
//!
//! Some points of a scan are remembered in the frame of the odometry, wherever no landmark is. If the vehicle moves as its odometry says,
//! the next scan sees nearly all of them again: a beam toward one ends there. If a large share is seen through, or hidden by what was not
//! there, the laser has moved otherwise: the vehicle was carried or has slid. A corridor or a plain wall looks the same along itself;
//! what moves there is not told.

use heapless::Vec;
use serde::{Deserialize, Serialize};

use crate::geometry::{Point, Pose, ScanPoint};
use crate::measurement::{Scan, Time};

/// Points that are remembered, spread over all beams.
const POINTS: usize = 32;
/// Fewer that can be looked for tell nothing: in a narrow view one thing that is passed hides a large share.
const LEAST: usize = 16;
/// After a longer pause between two scans, s, nothing is compared: the view has changed.
const LONGEST_PAUSE: f64 = 0.3;
/// Points between these ranges, m, are remembered: the nearer ones may be the vehicle's own, the farther ones are struck at grazing angles.
const RANGES: (f64, f64) = (0.5, 12.0);
/// A point is elsewhere if all beams toward it, within this distance, m, and this turn, rad, end so much nearer or farther, m.
const BESIDE: (f64, f64) = (0.1, 0.01);
const ELSEWHERE: f64 = 0.4;
/// Shares of the points that are elsewhere in one scan, and in each of two in a row.
const SHARES: [f64; 2] = [0.6, 0.4];
/// If more than this share is, it confirms what landmarks say; if no more is, it speaks against what few of them say.
const DOUBTFUL: f64 = 0.2;
/// Scans in a row that must disagree.
const IN_A_ROW: u8 = 2;
/// Parts of a scan in each of which the laser is taken to stand still: it moves by a centimetre or two in one.
const PARTS: usize = 8;

/// The points of an earlier scan, and how often they were contradicted.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct SurfaceCheck {
    points: Vec<ScanPoint, POINTS>,
    last: Time,
    contradictions: u8,
    /// Whether so many points were elsewhere in the last scan that it confirms what others say of the motion. None if too few could be looked
    /// for.
    is_doubtful: Option<bool>,
}

impl SurfaceCheck {
    /// A check that has seen nothing.
    #[must_use]
    pub const fn new() -> Self {
        Self { points: Vec::new(), last: Time::from_micros(0), contradictions: 0, is_doubtful: None }
    }

    /// Forgets everything.
    pub fn clear(&mut self) {
        self.points.clear();
        self.contradictions = 0;
        self.is_doubtful = None;
    }

    /// Whether so many points were elsewhere in the last scan that it confirms what others say of the motion.
    #[must_use]
    pub fn is_doubtful(&self) -> bool {
        self.is_doubtful == Some(true)
    }

    /// Whether nearly all points were where they ought to be in the last scan.
    #[must_use]
    pub fn agrees(&self) -> bool {
        self.is_doubtful == Some(false)
    }

    /// Takes a scan; `sensor` is where the laser was in the frame of the odometry so many seconds after the first beam. True if the
    /// laser has moved otherwise than the odometry says.
    pub fn disagrees(&mut self, scan: &Scan, sensor: impl Fn(f64) -> Pose) -> bool {
        if scan.start.since(self.last) > LONGEST_PAUSE {
            self.clear();
        }
        self.last = scan.start;
        let parts = Parts::of(scan, sensor);
        let (mut asked, mut elsewhere) = (0_u8, 0_u8);
        for point in &self.points {
            let Some(is_elsewhere) = is_elsewhere(scan, &point.cast(), &parts) else { continue };
            asked = asked.saturating_add(1);
            elsewhere = elsewhere.saturating_add(u8::from(is_elsewhere));
        }
        let can_tell = usize::from(asked) >= LEAST;
        let exceeds = |share: f64| can_tell && f64::from(elsewhere) > share * f64::from(asked);
        let [at_once, in_a_row] = SHARES.map(exceeds);
        self.is_doubtful = can_tell.then(|| exceeds(DOUBTFUL));
        // What contradicts is compared with the same points once more.
        if !in_a_row || self.contradictions > 0 {
            self.remember(scan, &parts);
        }
        self.contradictions = if in_a_row { self.contradictions.saturating_add(1) } else { 0 };
        at_once || self.contradictions >= IN_A_ROW
    }

    fn remember(&mut self, scan: &Scan, parts: &Parts) {
        self.points.clear();
        let every = scan.ranges.len().div_ceil(POINTS).max(1);
        for (index, range) in scan.ranges.iter().enumerate().step_by(every) {
            let range = f64::from(*range);
            if (RANGES.0..=RANGES.1).contains(&range) {
                let (sin, cos) = libm::sincos(scan.bearing(index));
                let place = parts.at(index).in_odometry(&Point::new(range * cos, range * sin));
                // The points are no more than there is room for.
                let _ = self.points.push(place.cast());
            }
        }
    }
}

/// Where the laser stands in a part of a scan, in the frame of the odometry.
#[derive(Clone, Copy, Debug)]
struct Stand {
    place: Point,
    /// Of its heading.
    sine: f64,
    cosine: f64,
}

impl Stand {
    fn in_odometry(self, point: &Point) -> Point {
        let (x, y) = (point.x, point.y);
        self.place + Point::new(self.cosine * x - self.sine * y, self.sine * x + self.cosine * y)
    }

    fn seen_from(self, place: &Point) -> Point {
        let (x, y) = (place.x - self.place.x, place.y - self.place.y);
        Point::new(self.cosine * x + self.sine * y, self.cosine * y - self.sine * x)
    }
}

/// Where the laser stands in all parts of a scan.
struct Parts {
    stands: [Stand; PARTS],
    /// Beams of a part.
    beams: usize,
}

impl Parts {
    fn of(scan: &Scan, sensor: impl Fn(f64) -> Pose) -> Self {
        let beams = scan.ranges.len().div_ceil(PARTS).max(1);
        let stand = |part: usize| {
            let pose = sensor((part as f64 + 0.5) * beams as f64 * scan.beam_interval);
            let (sine, cosine) = libm::sincos(pose.theta);
            Stand { place: pose.position(), sine, cosine }
        };
        Self { stands: core::array::from_fn(stand), beams }
    }

    fn middle(&self) -> Stand {
        self.of_part(PARTS / 2)
    }

    fn at(&self, beam: usize) -> Stand {
        self.of_part(beam.checked_div(self.beams).unwrap_or(0))
    }

    fn of_part(&self, part: usize) -> Stand {
        let [first, ..] = self.stands;
        self.stands.get(part).copied().unwrap_or(first)
    }
}

impl Default for SurfaceCheck {
    fn default() -> Self {
        Self::new()
    }
}

/// Whether no beam toward a place in the frame of the odometry ends there; none if some of them ended nowhere, or none looked there.
fn is_elsewhere(scan: &Scan, place: &Point, parts: &Parts) -> Option<bool> {
    let beam = scan.beam_toward(&parts.middle().seen_from(place))?;
    let seen = parts.at(beam).seen_from(place);
    let range = libm::hypot(seen.x, seen.y);
    let (nearest, farthest) = scan.ends_toward(&seen, BESIDE)?;
    Some(nearest > range + ELSEWHERE || farthest < range - ELSEWHERE)
}

//! Organised clouds: a ring a row, a column a direction.

use crate::calibration::Laser;
use crate::packet::{Point, counts_between};

/// A cloud of `RINGS` rings, ordered from the highest beam to the lowest, borrowed column by column.
#[derive(Clone, Copy, Debug)]
pub struct Cloud<'a> {
    points: &'a [Option<[f32; 3]>],
    rings: usize,
}

impl<'a> Cloud<'a> {
    /// Ring after ring, each with the same number of columns that go once round; None where nothing was seen, else
    /// x, y, z, m. None if the number of points is no multiple of `rings`.
    #[must_use]
    pub fn new(points: &'a [Option<[f32; 3]>], rings: usize) -> Option<Self> {
        (rings > 0 && points.len().is_multiple_of(rings)).then_some(Self { points, rings })
    }

    /// Number of rings.
    #[must_use]
    pub fn rings(&self) -> usize {
        self.rings
    }

    /// Number of columns.
    #[must_use]
    pub fn columns(&self) -> usize {
        self.points.len() / self.rings
    }

    /// The columns of a ring.
    #[must_use]
    pub fn ring(&self, ring: usize) -> &'a [Option<[f32; 3]>] {
        let columns = self.columns();
        self.points.get(ring * columns..(ring + 1) * columns).unwrap_or(&[])
    }

    /// All points that were seen.
    pub fn seen(&self) -> impl Iterator<Item = [f32; 3]> + use<'a> {
        self.points.iter().copied().flatten()
    }
}

/// Most rings.
const RINGS: usize = 128;
/// Hundredths of a degree in a turn.
const TURN: u32 = 36_000;

/// Which ring each laser is, and where its returns belong in a ring.
#[derive(Clone, Copy, Debug)]
pub struct RingOrder {
    /// By the number of the laser: its ring, and its rotation in the head, 0.01 degrees.
    lasers: [(u8, u16); RINGS],
    rings: usize,
}

impl RingOrder {
    /// The rings from the highest beam to the lowest; of lasers that are not in use there is none.
    #[must_use]
    pub fn new(lasers: &[Laser]) -> Self {
        let mut order = Self { lasers: [(u8::MAX, 0); RINGS], rings: 0 };
        let used = |laser: &&Laser| laser.is_enabled;
        order.rings = lasers.iter().take(RINGS).filter(used).count();
        for (number, (laser, target)) in
            lasers.iter().zip(&mut order.lasers).enumerate().filter(|(_, (l, _))| l.is_enabled)
        {
            let is_above = |(other_number, other): &(usize, &Laser)| {
                other.elevation > laser.elevation || (other.elevation == laser.elevation && *other_number < number)
            };
            let above = lasers.iter().take(RINGS).enumerate().filter(|(_, l)| l.is_enabled).filter(is_above).count();
            let counts = libm::round(laser.rotation.to_degrees() * 100.0) as i32;
            *target = (above as u8, counts.rem_euclid(TURN as i32) as u16);
        }
        order
    }

    /// Number of rings.
    #[must_use]
    pub fn rings(&self) -> usize {
        self.rings
    }

    /// Puts a point into an organised cloud of [`Self::rings`] rings; column 0 looks ahead, and columns go on clockwise.
    /// Of two returns in one place the nearer one stays. Whether there is a place for it.
    pub fn put(&self, cloud: &mut [Option<[f32; 3]>], point: &Point) -> bool {
        let columns = cloud.len() / self.rings.max(1);
        let Some((ring, rotation)) = self.lasers.get(usize::from(point.laser)).copied() else { return false };
        let direction = u32::from(counts_between(rotation, point.azimuth));
        let column = direction as usize * columns / TURN as usize;
        let Some(place) = cloud.get_mut(usize::from(ring) * columns + column) else { return false };
        let squared = |[x, y, z]: [f32; 3]| x * x + y * y + z * z;
        if place.is_none_or(|other| squared(point.position) < squared(other)) {
            *place = Some(point.position);
        }
        true
    }
}

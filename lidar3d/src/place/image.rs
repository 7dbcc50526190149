//! A place from above, in sectors and rings, that says which sectors it knows.
//!
//! The bins are those of Scan Context (Kim and Kim 2018). As a mast or a load hides whole sectors, a sector of which hardly
//! a beam comes back is not known, and no distance counts it.

use super::Floor;
use crate::cloud::Cloud;

/// Sectors of an image.
pub const SECTORS: usize = 60;
/// Rings of an image.
pub const RINGS: usize = 20;
/// Width of a ring, m.
const RING: f32 = 4.0;
/// A sector is known if this part of its beams comes back.
const KNOWN: f32 = 0.05;
/// Two images are compared only if they both know so many sectors at a turn.
const LEAST_SECTORS: u32 = 10;
/// Heights are stored as this by their root, so that 26 m is the greatest.
const SCALE: f32 = 50.0;

/// A place from above: the greatest height above the floor in each sector and ring.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PlaceImage {
    /// Sector after sector, counter-clockwise from straight ahead.
    bins: [[u8; RINGS]; SECTORS],
    /// A bit a sector.
    known: u64,
}

/// How two images are alike.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Likeness {
    /// 0 if they are the same, 1 if they have nothing in common.
    pub distance: f32,
    /// By how many sectors the asked scene is turned counter-clockwise against the stored one, best first.
    pub turns: [usize; 2],
}

impl PlaceImage {
    /// Bytes of an image when it is stored.
    pub const BYTES: usize = SECTORS * RINGS + 8;

    /// The image of a scan above a floor.
    #[must_use]
    pub fn new(cloud: &Cloud<'_>, floor: &Floor) -> Self {
        let mut bins = [[0_u8; RINGS]; SECTORS];
        let mut returned = [0_u32; SECTORS];
        for point in cloud.seen() {
            let [x, y, height] = floor.levelled(point);
            let sector = sector(x, y);
            let Some(count) = returned.get_mut(sector) else { continue };
            *count += 1;
            let ring = (libm::sqrtf(x * x + y * y) / RING) as usize;
            let value = (SCALE * libm::sqrtf(height.max(0.0))).min(255.0) as u8;
            if let Some(bin) = bins.get_mut(sector).and_then(|rings| rings.get_mut(ring)) {
                *bin = (*bin).max(value);
            }
        }
        let beams = (cloud.rings() * cloud.columns()) as f32 / SECTORS as f32;
        let is_known = |(_, count): &(usize, &u32)| **count as f32 > KNOWN * beams;
        let known = returned.iter().enumerate().filter(is_known).fold(0, |known, (sector, _)| known | 1 << sector);
        Self { bins, known }
    }

    /// How alike an image that is asked for is to this one: the cosine over all bins of the sectors that both know, at the
    /// best of all turns. None if they nowhere know enough in common.
    #[must_use]
    pub fn likeness(&self, asked: &Self) -> Option<Likeness> {
        let mut distances = [f32::MAX; SECTORS];
        for (turn, distance) in distances.iter_mut().enumerate() {
            *distance = self.distance_at(asked, turn);
        }
        let best = |except: Option<usize>| {
            let turns =
                distances.iter().enumerate().filter(|(turn, _)| except.is_none_or(|best| apart(*turn, best) > 1));
            turns.min_by(|a, b| a.1.total_cmp(b.1))
        };
        let (first, distance) = best(None).filter(|(_, distance)| **distance < f32::MAX)?;
        let second = best(Some(first)).map_or(first, |(turn, _)| turn);
        Some(Likeness { distance: *distance, turns: [first, second] })
    }

    /// Distance where the asked scene is turned by so many sectors.
    fn distance_at(&self, asked: &Self, turn: usize) -> f32 {
        let (mut both, mut own, mut other, mut sectors) = (0_u32, 0_u32, 0_u32, 0_u32);
        for (sector, bins) in self.bins.iter().enumerate() {
            let there = (sector + turn) % SECTORS;
            if self.known >> sector & 1 == 0 || asked.known >> there & 1 == 0 {
                continue;
            }
            let Some(others) = asked.bins.get(there) else { continue };
            sectors += 1;
            for (a, b) in bins.iter().zip(others) {
                let (a, b) = (u32::from(*a), u32::from(*b));
                both += a * b;
                own += a * a;
                other += b * b;
            }
        }
        if sectors < LEAST_SECTORS || own == 0 || other == 0 {
            return f32::MAX;
        }
        1.0 - both as f32 / libm::sqrtf(own as f32 * other as f32)
    }

    /// Number of sectors that it knows.
    #[must_use]
    pub fn known_sectors(&self) -> u32 {
        self.known.count_ones()
    }
}

/// Sectors between two turns.
fn apart(one: usize, other: usize) -> usize {
    let apart = one.abs_diff(other);
    apart.min(SECTORS - apart)
}

fn sector(x: f32, y: f32) -> usize {
    let share = libm::atan2f(y, x) / core::f32::consts::TAU;
    let share = if share < 0.0 { share + 1.0 } else { share };
    ((share * SECTORS as f32) as usize).min(SECTORS - 1)
}

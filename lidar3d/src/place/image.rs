//! A place from above, in sectors and rings, that says which sectors it knows.
//!
//! The bins are those of Scan Context (Kim and Kim 2018). As a mast or a load hides whole sectors, a sector of which hardly
//! a beam comes back is not known, and no distance counts it.

use core::ops::Range;

use wide::{i16x8, i32x4};

use super::Floor;
use super::arctangent::sector_of;
use super::levelled::Block;
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

impl Likeness {
    /// The headings that the asked scan may have in the stored place, rad, counter-clockwise, best first.
    #[must_use]
    pub fn headings(&self) -> [f32; 2] {
        self.turns.map(|turn| -(turn as f32) * core::f32::consts::TAU / SECTORS as f32)
    }
}

impl PlaceImage {
    /// Bytes of an image when it is stored.
    pub const BYTES: usize = SECTORS * RINGS + 8;

    /// The image of a scan above a floor.
    #[must_use]
    pub fn new(cloud: &Cloud<'_>, floor: &Floor) -> Self {
        let mut bins = [[0_u8; RINGS]; SECTORS];
        let mut returned = [0_u32; SECTORS];
        for block in Block::all(cloud, floor) {
            let rings = block.levels().map(|level| level / RING);
            let values = block.up.map(|up| (SCALE * libm::sqrtf(up.max(0.0))).min(255.0));
            for ((turn, ring), value) in block.turns().iter().zip(rings).zip(values).take(block.count) {
                let sector = sector_of(*turn, SECTORS);
                let Some(count) = returned.get_mut(sector) else { continue };
                *count += 1;
                if let Some(bin) = bins.get_mut(sector).and_then(|rings| rings.get_mut(ring as usize)) {
                    *bin = (*bin).max(value as u8);
                }
            }
        }
        let beams = (cloud.rings() * cloud.columns()) as f32 / SECTORS as f32;
        let is_known = |(_, count): &(usize, &u32)| **count as f32 > KNOWN * beams;
        let known = returned.iter().enumerate().filter(is_known).fold(0_u64, |known, (sector, _)| known | 1 << sector);
        for (sector, rings) in bins.iter_mut().enumerate() {
            if known >> sector & 1 == 0 {
                *rings = [0; RINGS];
            }
        }
        Self { bins, known }
    }

    /// How alike an image that is asked for is to this one: the cosine over all bins of the sectors that both know, at the
    /// best of all turns. None if they nowhere know enough in common.
    #[must_use]
    pub fn likeness(&self, asked: &Self) -> Option<Likeness> {
        AskedImage::new(asked).likeness(self)
    }

    /// Squares of the lengths of the sectors, as they are compared; nothing of those that it does not know.
    fn squares(&self) -> [u32; SECTORS] {
        self.bins.map(|rings| rings.iter().map(|bin| u32::from(*bin) * u32::from(*bin)).sum())
    }

    fn factors(&self) -> Bins {
        self.bins.map(|rings| rings.map(i16::from))
    }

    fn masks(&self) -> Masks {
        core::array::from_fn(|sector| if self.known >> sector & 1 == 1 { u32::MAX } else { 0 })
    }

    /// As it is stored: bins, sector after sector, and a bit a sector that it knows.
    #[must_use]
    pub fn to_bytes(&self) -> [u8; Self::BYTES] {
        let mut bytes = [0; Self::BYTES];
        let known = self.known.to_le_bytes();
        for (byte, value) in bytes.iter_mut().zip(self.bins.as_flattened().iter().chain(&known)) {
            *byte = *value;
        }
        bytes
    }

    /// What [`Self::to_bytes`] has made; None if it is something else.
    #[must_use]
    pub fn from_bytes(bytes: &[u8; Self::BYTES]) -> Option<Self> {
        let (rings, known) = bytes.split_at(SECTORS * RINGS);
        let known = u64::from_le_bytes(known.try_into().ok()?);
        let mut bins = [[0; RINGS]; SECTORS];
        for (bin, value) in bins.as_flattened_mut().iter_mut().zip(rings) {
            *bin = *value;
        }
        let is_empty = |(sector, rings): (usize, &[u8; RINGS])| known >> sector & 1 == 1 || *rings == [0; RINGS];
        (known >> SECTORS == 0 && bins.iter().enumerate().all(is_empty)).then_some(Self { bins, known })
    }

    /// Rings of those of some sectors that it knows.
    pub(super) fn known_of(&self, sectors: Range<usize>) -> impl Iterator<Item = &[u8; RINGS]> {
        let bins = sectors.clone().zip(self.bins.get(sectors).unwrap_or_default());
        bins.filter(|(sector, _)| self.known >> sector & 1 == 1).map(|(_, rings)| rings)
    }

    /// Number of sectors that it knows.
    #[must_use]
    pub fn known_sectors(&self) -> u32 {
        self.known.count_ones()
    }
}

/// Bins that are multiplied at once; all are a multiple of it.
const LANES: usize = 8;
const _: () = assert!((SECTORS * RINGS).is_multiple_of(LANES));

/// Bins as they are multiplied.
type Bins = [[i16; RINGS]; SECTORS];

/// All ones for a sector that is known.
type Masks = [u32; SECTORS];

/// An image that is asked for, ready to be compared with many.
#[derive(Clone, Debug)]
pub struct AskedImage {
    /// Its sectors, twice round.
    bins: [Bins; 2],
    known: [Masks; 2],
    squares: [[u32; SECTORS]; 2],
}

/// A stored image, ready to be compared at all turns.
struct StoredImage {
    bins: Bins,
    known: Masks,
    squares: [u32; SECTORS],
}

impl AskedImage {
    /// Of an image.
    #[must_use]
    pub fn new(image: &PlaceImage) -> Self {
        Self { bins: [image.factors(); 2], known: [image.masks(); 2], squares: [image.squares(); 2] }
    }

    /// How alike it is to a stored one: see [`PlaceImage::likeness`].
    #[must_use]
    pub fn likeness(&self, stored: &PlaceImage) -> Option<Likeness> {
        let stored = StoredImage { bins: stored.factors(), known: stored.masks(), squares: stored.squares() };
        let mut distances = [f32::MAX; SECTORS];
        for (turn, distance) in distances.iter_mut().enumerate() {
            *distance = self.distance_at(&stored, turn);
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
    fn distance_at(&self, stored: &StoredImage, turn: usize) -> f32 {
        // No sum comes near to what it can hold; unchecked, they are added side by side.
        let turned = |of: &[[u32; SECTORS]; 2]| -> [u32; SECTORS] {
            let sectors = of.as_flattened().get(turn..turn + SECTORS);
            sectors.and_then(|sectors| sectors.try_into().ok()).unwrap_or([0; SECTORS])
        };
        let (known, squares) = (turned(&self.known), turned(&self.squares));
        let common = known.iter().zip(&stored.known).map(|(one, other)| one & other & 1).fold(0, u32::wrapping_add);
        if common < LEAST_SECTORS {
            return f32::MAX;
        }
        let bins = self.bins.as_flattened().get(turn..turn + SECTORS).unwrap_or_default();
        // What one of them does not know is empty there.
        let lanes = |bins| <[i16]>::as_chunks::<LANES>(bins).0.iter().map(|lanes| i16x8::new(*lanes));
        let pairs = lanes(stored.bins.as_flattened()).zip(lanes(bins.as_flattened()));
        let both: i32 = pairs.fold(i32x4::default(), |sum, (a, b)| sum + a.dot(b)).reduce_add();
        let length = |squares: &[u32; SECTORS], known: &Masks| -> u32 {
            squares.iter().zip(known).map(|(square, known)| square & known).fold(0, u32::wrapping_add)
        };
        let (own, other) = (length(&stored.squares, &known), length(&squares, &stored.known));
        if own == 0 || other == 0 {
            return f32::MAX;
        }
        1.0 - both as f32 / libm::sqrtf(own as f32 * other as f32)
    }
}

/// Sectors between two turns.
fn apart(one: usize, other: usize) -> usize {
    let apart = one.abs_diff(other);
    apart.min(SECTORS - apart)
}

//! What an image has in each ring whatever way it is turned: a short key, by which those of many places are chosen that are
//! compared as a whole.
//!
//! Means and deviations in each ring are the same whatever way the sensor faces, but not where a load hides a part of what is
//! around. So sums are kept by parts of a turn: a scan with hidden sectors is compared with what each place would be with the same
//! sectors hidden, whatever way it faces.

use wide::f32x4;

use super::image::{PlaceImage, RINGS, SECTORS};

/// Parts of a turn whose sums are kept apart, and sectors of each.
const PARTS: usize = 6;
const WIDTH: usize = SECTORS / PARTS;

/// Heights in each ring, of each part of a turn: their mean and the mean of their squares, over the sectors that the image knows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RingKey {
    means: [[u8; RINGS]; PARTS],
    squares: [[u16; RINGS]; PARTS],
    /// Sectors that the image knows.
    known: [u8; PARTS],
}

/// The key of a scan that is asked for.
#[derive(Clone, Debug)]
pub struct AskedKey {
    rings: Rings,
    /// Whichever way it faces: of each part of a turn, how many of its sectors the scan knows.
    facing: [[f32; PARTS]; PARTS],
    /// Ways that differ: one if it knows all sectors.
    ways: usize,
}

/// A value of each ring.
type OfRings = [f32x4; RINGS / 4];
const _: () = assert!(RINGS.is_multiple_of(4));

/// Mean and deviation of the heights in each ring.
#[derive(Clone, Copy, Debug)]
struct Rings {
    means: OfRings,
    deviations: OfRings,
}

/// A key as it is reckoned with: of each part the sums of its sectors.
struct Sums {
    sums: [OfRings; PARTS],
    squares: [OfRings; PARTS],
    known: [f32; PARTS],
}

impl RingKey {
    /// Of an image.
    #[must_use]
    pub fn new(image: &PlaceImage) -> Self {
        let mut key = Self { means: [[0; RINGS]; PARTS], squares: [[0; RINGS]; PARTS], known: [0; PARTS] };
        let parts = key.means.iter_mut().zip(&mut key.squares).zip(&mut key.known).enumerate();
        for (part, ((means, squares), known)) in parts {
            let sectors = || image.known_of(part * WIDTH..(part + 1) * WIDTH);
            *known = sectors().count() as u8;
            let count = u32::from(*known).max(1);
            for (ring, (mean, square)) in means.iter_mut().zip(squares).enumerate() {
                let bins = || sectors().filter_map(|rings| rings.get(ring)).map(|bin| u32::from(*bin));
                *mean = ((bins().sum::<u32>() + count / 2) / count) as u8;
                *square = ((bins().map(|bin| bin * bin).sum::<u32>() + count / 2) / count) as u16;
            }
        }
        key
    }

    fn sums(&self) -> Sums {
        let known = self.known.map(f32::from);
        let weighted = |part: usize, value: OfRings| value.map(|lanes| lanes * known[part]);
        Sums {
            sums: core::array::from_fn(|part| weighted(part, of_rings(&self.means[part]))),
            squares: core::array::from_fn(|part| weighted(part, of_rings(&self.squares[part]))),
            known,
        }
    }
}

impl AskedKey {
    /// Of an image.
    #[must_use]
    pub fn new(image: &PlaceImage) -> Self {
        let sums = RingKey::new(image).sums();
        let facing = core::array::from_fn(|way| core::array::from_fn(|part| sums.known[(part + way) % PARTS]));
        let is_whole = image.known_sectors() as usize == SECTORS;
        Self { rings: sums.rings(&[1.0; PARTS]), facing, ways: if is_whole { 1 } else { PARTS } }
    }

    /// Square of the distance from a stored key, at the way of facing that makes it least.
    #[must_use]
    pub fn square_distance(&self, stored: &RingKey) -> f32 {
        let sums = stored.sums();
        let distances = self.facing.iter().take(self.ways).map(|seen| self.rings.square_distance(&sums.rings(seen)));
        distances.fold(f32::MAX, f32::min)
    }
}

impl Sums {
    /// Mean and deviation over the turn, where so many sectors of each part are seen.
    fn rings(&self, seen: &[f32; PARTS]) -> Rings {
        let (mut means, mut squares, mut all) = ([f32x4::ZERO; RINGS / 4], [f32x4::ZERO; RINGS / 4], 0.0_f32);
        for (((part, square), known), seen) in self.sums.iter().zip(&self.squares).zip(&self.known).zip(seen) {
            all += known * seen;
            for ((sum, sum_of_squares), (part, square)) in
                means.iter_mut().zip(squares.iter_mut()).zip(part.iter().zip(square))
            {
                *sum += *part * *seen;
                *sum_of_squares += *square * *seen;
            }
        }
        let share = 1.0 / all.max(1.0);
        for (mean, square) in means.iter_mut().zip(&mut squares) {
            *mean *= f32x4::splat(share);
            *square = (*square * share - *mean * *mean).max(f32x4::ZERO).sqrt();
        }
        Rings { means, deviations: squares }
    }
}

impl Rings {
    fn square_distance(&self, other: &Self) -> f32 {
        let square = |sum: f32x4, (a, b): (&f32x4, &f32x4)| sum + (*a - *b) * (*a - *b);
        let means = self.means.iter().zip(&other.means).fold(f32x4::ZERO, square);
        self.deviations.iter().zip(&other.deviations).fold(means, square).reduce_add()
    }
}

fn of_rings<T: Copy + Into<f32>>(values: &[T; RINGS]) -> OfRings {
    core::array::from_fn(|lanes| f32x4::new(core::array::from_fn(|lane| values[4 * lanes + lane].into())))
}

#[cfg(test)]
mod tests {
    use super::*;

    const KNOWN: usize = SECTORS * RINGS;

    /// An image with other heights in each sector, turned by so many parts, and blind in the first ones.
    fn image(seed: usize, turned: usize, blind: usize) -> PlaceImage {
        let mut bytes = [0; PlaceImage::BYTES];
        let mut known = 0_u64;
        for sector in blind * WIDTH..SECTORS {
            let from = (sector + turned * WIDTH) % SECTORS;
            for (ring, bin) in bytes[sector * RINGS..(sector + 1) * RINGS].iter_mut().enumerate() {
                *bin = ((from * 31 + ring * 17 + seed * 101) * (from + 3 + seed) % 211) as u8;
            }
            known |= 1 << sector;
        }
        bytes[KNOWN..].copy_from_slice(&known.to_le_bytes());
        PlaceImage::from_bytes(&bytes).unwrap()
    }

    /// Whatever is hidden and whatever way the sensor faces, a place is nearer to itself than to others, and as near as rounding
    /// allows.
    #[test]
    fn a_place_is_near_to_itself_with_sectors_hidden() {
        let stored: [RingKey; 8] = core::array::from_fn(|seed| RingKey::new(&image(seed, 0, 0)));
        for (turned, blind) in (0..PARTS).flat_map(|turned| [0, 1, 2].map(|blind| (turned, blind))) {
            let asked = AskedKey::new(&image(0, turned, blind));
            let distances = stored.map(|key| asked.square_distance(&key));
            assert!(distances[0] < 2.0 * RINGS as f32, "{turned}, {blind}: {distances:?}");
            assert!(
                distances[1..].iter().all(|other| *other > 20.0 * distances[0]),
                "{turned}, {blind}: {distances:?}"
            );
        }
    }

    /// What a place has not seen does not count either.
    #[test]
    fn a_place_with_hidden_sectors_is_near_to_itself() {
        let stored = RingKey::new(&image(0, 0, 2));
        let asked = AskedKey::new(&image(0, 0, 2));
        assert!(asked.square_distance(&stored) < 2.0 * RINGS as f32);
    }
}

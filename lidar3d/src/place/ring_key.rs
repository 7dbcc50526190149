//! What an image has in each ring whatever way it is turned: a short key, by which those of many places are chosen that are
//! compared as a whole.

use super::image::{PlaceImage, RINGS};

/// Mean and deviation of the heights in each ring, over the sectors that the image knows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RingKey([u8; 2 * RINGS]);

impl RingKey {
    /// Of an image.
    #[must_use]
    pub fn new(image: &PlaceImage) -> Self {
        let mut key = [0; 2 * RINGS];
        let count = image.known_sectors().max(1) as f32;
        for (ring, values) in key.as_chunks_mut::<2>().0.iter_mut().enumerate() {
            let (mut sum, mut squares) = (0_u32, 0_u32);
            for bin in image.sectors().filter_map(|rings| rings.get(ring)) {
                sum += u32::from(*bin);
                squares += u32::from(*bin) * u32::from(*bin);
            }
            let mean = sum as f32 / count;
            let deviation = libm::sqrtf((squares as f32 / count - mean * mean).max(0.0));
            *values = [mean, deviation].map(|value| libm::roundf(value) as u8);
        }
        Self(key)
    }

    /// Square of the distance of two keys.
    #[must_use]
    pub fn square_distance(&self, other: &Self) -> u32 {
        let pairs = self.0.iter().zip(&other.0);
        pairs.map(|(a, b)| (i32::from(*a) - i32::from(*b)).pow(2).cast_unsigned()).sum()
    }
}

//! Pairs of seen reflectors, and which of them a mapped pair may be.

use heapless::Vec;

use super::squared_distance::{bucket, buckets};

/// Most pairs that are sought; twice as many are counted in a byte.
const PAIRS: usize = 96;

/// A factor of two of squared distance is divided into 256: buckets of 6 cm at 30 m.
const BITS: u32 = 8;

const WORDS: usize = buckets(BITS).div_ceil(32);

/// A pair of seen reflectors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SoughtPair {
    /// Number of the first reflector.
    pub(super) first: u8,
    /// Number of the second reflector.
    pub(super) second: u8,
    /// Least squared distance of the mapped pair, m^2.
    pub(super) least: f32,
    /// Largest squared distance of the mapped pair, m^2.
    pub(super) largest: f32,
}

/// Pairs of seen reflectors with what distances a mapped pair like them has.
#[derive(Clone, Debug)]
pub(super) struct SoughtPairs {
    pairs: Vec<SoughtPair, PAIRS>,
    /// Buckets that at least one pair's distances touch: most mapped pairs are refused by one bit.
    touched: [u32; WORDS],
}

impl SoughtPairs {
    pub(super) const fn new() -> Self {
        Self { pairs: Vec::new(), touched: [0; WORDS] }
    }

    pub(super) fn clear(&mut self) {
        self.pairs.clear();
        self.touched = [0; WORDS];
    }

    /// Adds a pair; one beyond the capacity is left out.
    pub(super) fn push(&mut self, pair: SoughtPair) {
        if self.pairs.push(pair).is_err() {
            return;
        }
        for place in bucket(pair.least, BITS)..=bucket(pair.largest, BITS) {
            if let Some(word) = self.touched.get_mut(place / 32) {
                *word |= 1 << (place % 32);
            }
        }
    }

    /// Whether a mapped pair of that squared distance (m^2) may be one of these.
    #[inline]
    pub(super) fn may_hold(&self, square: f32) -> bool {
        let place = bucket(square, BITS);
        self.touched.get(place / 32).is_some_and(|word| word >> (place % 32) & 1 == 1)
    }

    /// The pairs.
    pub(super) fn pairs(&self) -> &[SoughtPair] {
        &self.pairs
    }
}

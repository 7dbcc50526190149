//! Buckets of squared distances whose width grows with the distance, told from a number's bits without a root.

/// Shorter distances share the first bucket, m^2.
const SHORTEST: f32 = 0.0625;

/// Distances over 128 m share the last bucket: factors of two between it and the first one.
const OCTAVES: usize = 18;

/// Bits of a single precision number's fraction.
const FRACTION: u32 = 23;

/// Number of buckets if each factor of two is divided into `2^bits`.
pub(super) const fn buckets(bits: u32) -> usize {
    OCTAVES << bits
}

/// Bucket of a squared distance, m^2.
#[inline]
pub(super) fn bucket(square: f32, bits: u32) -> usize {
    let first = SHORTEST.to_bits() >> (FRACTION - bits);
    // The bits of positive numbers are in the order of the numbers.
    let place = (square.max(SHORTEST).to_bits() >> (FRACTION - bits)) - first;
    (place as usize).min(buckets(bits) - 1)
}

/// Width of a bucket, m^2.
pub(super) fn width(bucket: usize, bits: u32) -> f32 {
    let octave = (bucket >> bits) as i32;
    SHORTEST * libm::scalbnf(1.0, octave - bits as i32)
}

//! Numbers that no other chip has: its own (RM0433, 61.1 "Unique device ID register"), and random ones (chapter 33).

use embassy_stm32::pac::{RCC, RNG};
use embassy_stm32::uid;

/// How often is looked whether a number is there: some 100 us.
const PATIENCE: u32 = 1000;

/// The chip's own number of 96 bits in 32 bits: place on the wafer, wafer and lot, which do not come together in another chip of one lot.
#[must_use]
pub fn serial() -> u32 {
    let own = uid::uid();
    own.as_chunks::<4>().0.iter().fold(0, |sum: u32, word| sum.rotate_left(11) ^ u32::from_le_bytes(*word))
}

/// A number that nobody can foresee; if the generator gives none, one that is at least the chip's own.
#[must_use]
pub fn seed() -> u64 {
    RCC.ahb2enr().modify(|enabled| enabled.set_rngen(true));
    RNG.cr().modify(|control| control.set_rngen(true));
    let seed = uid::uid().iter().fold(0, |sum: u64, byte| sum.rotate_left(7) ^ u64::from(*byte));
    (0..2).fold(seed, |seed, _| seed.rotate_left(32) ^ u64::from(word().unwrap_or_default()))
}

fn word() -> Option<u32> {
    (0..PATIENCE).any(|_| RNG.sr().read().drdy()).then(|| RNG.dr().read())
}

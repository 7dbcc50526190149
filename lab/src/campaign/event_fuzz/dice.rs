//! Choices, from a fuzzer's bytes or from a seed.

use rand::Rng;
use rand_chacha::ChaCha8Rng;

/// Where choices come from.
pub trait Source {
    /// The next byte; none at the end.
    fn next(&mut self) -> Option<u8>;
}

impl Source for &[u8] {
    fn next(&mut self) -> Option<u8> {
        self.split_off_first().copied()
    }
}

impl Source for ChaCha8Rng {
    fn next(&mut self) -> Option<u8> {
        Some(self.next_u32() as u8)
    }
}

/// Numbers that some program has stumbled over.
const STRANGE: [f64; 24] = [
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
    0.0,
    -0.0,
    f64::MIN_POSITIVE,
    5e-324,
    -1e-40,
    1e-12,
    -1e-6,
    1.0,
    -1.0,
    core::f64::consts::PI,
    -core::f64::consts::PI,
    core::f64::consts::FRAC_PI_2,
    1e3,
    -1e6,
    1e9,
    -1e16,
    1e38,
    -3.5e38,
    1e155,
    f64::MAX,
    f64::MIN,
];

/// Makes choices.
pub struct Dice<S> {
    source: S,
    has_ended: bool,
}

impl<S: Source> Dice<S> {
    /// Choices from that source.
    pub fn new(source: S) -> Self {
        Self { source, has_ended: false }
    }

    /// Whether the source is at its end; all further choices are the first one.
    pub fn has_ended(&self) -> bool {
        self.has_ended
    }

    pub fn byte(&mut self) -> u8 {
        let byte = self.source.next();
        self.has_ended |= byte.is_none();
        byte.unwrap_or(0)
    }

    pub fn word(&mut self) -> u32 {
        u32::from_le_bytes([self.byte(), self.byte(), self.byte(), self.byte()])
    }

    /// One of so many, from 0.
    pub fn below(&mut self, count: u8) -> u8 {
        (u16::from(self.byte()) * u16::from(count) / 256) as u8
    }

    /// True once in so many times.
    pub fn once_in(&mut self, times: u8) -> bool {
        self.below(times) + 1 == times
    }

    /// A number between the two.
    pub fn between(&mut self, least: f64, most: f64) -> f64 {
        let share = f64::from(u16::from_le_bytes([self.byte(), self.byte()])) / f64::from(u16::MAX);
        least + share * (most - least)
    }

    /// A number that no sensor should send: a famous one, or any bits.
    pub fn strange(&mut self) -> f64 {
        match STRANGE.get(usize::from(self.below(STRANGE.len() as u8 + 2))) {
            Some(number) => *number,
            None => f64::from_bits(u64::from(self.word()) << 32 | u64::from(self.word())),
        }
    }

    /// The number, or once in so many times a strange one.
    pub fn maybe_strange(&mut self, number: f64, times: u8) -> f64 {
        if self.once_in(times) { self.strange() } else { number }
    }
}

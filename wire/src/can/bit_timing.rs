//! How a bit is made of the quanta of a controller's clock (ISO 11898-1, 11.3; RM0433, 56.3.1 "Bit timing").

/// Bit rates that CiA 301 (table 1) has and the controller can be set to, kbit/s.
pub const BIT_RATES: [u16; 5] = [125, 250, 500, 800, 1000];

/// Where CiA 301 (table 1) wants the sample point, in thousandths of a bit, and how near it must be.
const SAMPLE_POINT: u32 = 875;
const NEAR: u32 = 25;
/// Quanta of a bit (ISO 11898-1, table 8).
const LEAST_QUANTA: u32 = 8;
const MOST_QUANTA: u32 = 25;
/// Quanta by which a bit may be made longer or shorter.
const JUMP: u32 = 2;
/// Largest prescaler of a FDCAN (RM0433, "FDCAN_NBTP").
const MOST_PRESCALER: u32 = 512;

/// The timing of a bit, in quanta: a synchronisation segment of one, and two segments with the sample point between them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BitTiming {
    /// Clocks of a quantum.
    pub prescaler: u16,
    /// Quanta before the sample point, without the first.
    pub before: u8,
    /// Quanta behind it.
    pub behind: u8,
    /// Quanta by which a bit may be made longer or shorter.
    pub jump: u8,
}

impl BitTiming {
    /// The timing for so many kbit/s from a clock in Hz, with the sample point nearest to 87.5 %. None if the clock does not
    /// give that rate exactly, or has no sample point within 2.5 % of it.
    #[must_use]
    pub fn new(clock: u32, bit_rate: u16) -> Option<Self> {
        let bits = 1000 * u32::from(bit_rate);
        let mut best: Option<(u32, Self)> = None;
        for quanta in LEAST_QUANTA..=MOST_QUANTA {
            let quanta_a_second = bits * quanta;
            if quanta_a_second == 0 || !clock.is_multiple_of(quanta_a_second) {
                continue;
            }
            let prescaler = clock / quanta_a_second;
            let behind = ((quanta * (1000 - SAMPLE_POINT) + 500) / 1000).max(JUMP);
            let found = (1000 * (quanta - behind) / quanta).abs_diff(SAMPLE_POINT);
            let is_better = best.is_none_or(|(nearest, _)| found < nearest);
            if (1..=MOST_PRESCALER).contains(&prescaler) && found <= NEAR && is_better {
                let (before, behind) = ((quanta - behind - 1) as u8, behind as u8);
                best = Some((found, Self { prescaler: prescaler as u16, before, behind, jump: JUMP as u8 }));
            }
        }
        best.map(|(_, timing)| timing)
    }

    /// Quanta of a bit.
    #[must_use]
    pub const fn quanta(self) -> u32 {
        1 + self.before as u32 + self.behind as u32
    }

    /// Where the bit is looked at, thousandths of it.
    #[must_use]
    pub const fn sample_point(self) -> u32 {
        1000 * (1 + self.before as u32) / self.quanta()
    }

    /// By how much the clocks of two nodes may be off, millionths, each: the smaller one of what resynchronisation makes good
    /// within ten bits, and of what is left at the end of an error frame (ISO 11898-1, 11.3.1.2).
    #[must_use]
    pub const fn tolerance(self) -> u32 {
        let bit = self.quanta();
        let resynchronised = 1_000_000 * self.jump as u32 / (20 * bit);
        let smaller = if self.before < self.behind { self.before } else { self.behind };
        let Some(after_error) = (1_000_000 * smaller as u32).checked_div(2 * (13 * bit - self.behind as u32)) else {
            return 0;
        };
        if resynchronised < after_error { resynchronised } else { after_error }
    }
}

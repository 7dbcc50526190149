//! Fixed-point numbers in a frame.

/// A number in a frame.
#[derive(Clone, Copy)]
pub(in crate::can) struct Field {
    first_bit: u32,
    bits: u32,
    is_signed: bool,
    scale: f64,
}

impl Field {
    pub(in crate::can) const fn signed(first_bit: u32, bits: u32, scale: f64) -> Self {
        Self { first_bit, bits, is_signed: true, scale }
    }

    pub(in crate::can) const fn unsigned(first_bit: u32, bits: u32, scale: f64) -> Self {
        Self { first_bit, bits, is_signed: false, scale }
    }

    pub(in crate::can) const fn mask(self) -> u64 {
        u64::MAX >> (64 - self.bits)
    }

    /// What stands for a number that is not known.
    pub(in crate::can) const fn unknown(self) -> u64 {
        if self.is_signed { 1 << (self.bits - 1) } else { self.mask() }
    }

    /// The largest number that can be told, steps.
    pub(in crate::can) const fn largest(self) -> f64 {
        if self.is_signed { ((1u64 << (self.bits - 1)) - 1) as f64 } else { (self.mask() - 1) as f64 }
    }

    pub(in crate::can) const fn put_raw(self, payload: u64, raw: u64) -> u64 {
        payload | (raw & self.mask()) << self.first_bit
    }

    pub(in crate::can) const fn take_raw(self, payload: u64) -> u64 {
        payload >> self.first_bit & self.mask()
    }

    pub(in crate::can) fn put(self, payload: u64, value: f64) -> u64 {
        let steps = libm::round(value / self.scale);
        let smallest = if self.is_signed { -self.largest() } else { 0.0 };
        let is_known = (smallest..=self.largest()).contains(&steps);
        self.put_raw(payload, if is_known { steps as i64 as u64 } else { self.unknown() })
    }

    /// A deviation: never smaller than it is.
    pub(in crate::can) fn put_deviation(self, payload: u64, value: f64) -> u64 {
        // A whole number of steps is not to become one more by rounding.
        let steps = libm::ceil(value / self.scale - 1e-6);
        let steps = if steps >= 0.0 { steps.min(self.largest()) } else { self.largest() };
        self.put_raw(payload, steps as u64)
    }

    /// A bound: never smaller than it is, and not known if it is too large.
    pub(in crate::can) fn put_bound(self, payload: u64, value: f64) -> u64 {
        let steps = libm::ceil(value / self.scale - 1e-6);
        let is_known = (0.0..=self.largest()).contains(&steps);
        self.put_raw(payload, if is_known { steps as u64 } else { self.unknown() })
    }

    /// The bound, or infinity if it is not known.
    pub(in crate::can) fn take_bound(self, payload: u64) -> f64 {
        let value = self.take(payload);
        if value.is_nan() { f64::INFINITY } else { value }
    }

    /// The number, or NaN if it is not known.
    pub(in crate::can) fn take(self, payload: u64) -> f64 {
        let raw = self.take_raw(payload);
        if raw == self.unknown() {
            return f64::NAN;
        }
        let unused = 64 - self.bits;
        let steps = if self.is_signed { ((raw << unused) as i64) >> unused } else { raw as i64 };
        steps as f64 * self.scale
    }
}

pub(super) const COUNTER: Field = Field::unsigned(60, 4, 1.0);
pub(super) const X: Field = Field::signed(0, 30, 1e-4);
pub(super) const Y: Field = Field::signed(30, 30, 1e-4);
pub(super) const HEADING: Field = Field::signed(0, 24, 1e-6);
pub(super) const TIME: Field = Field::unsigned(24, 16, 1e-3);
pub(super) const DEAD_RECKONING: Field = Field::unsigned(40, 16, 0.01);
pub(super) const DEVIATION_X: Field = Field::unsigned(0, 13, 0.00025);
pub(super) const DEVIATION_Y: Field = Field::unsigned(13, 13, 0.00025);
pub(super) const DEVIATION_HEADING: Field = Field::unsigned(26, 13, 1e-4);
pub(super) const CORRELATION_XY: Field = Field::signed(39, 7, 0.02);
pub(super) const CORRELATION_X_HEADING: Field = Field::signed(46, 7, 0.02);
pub(super) const CORRELATION_Y_HEADING: Field = Field::signed(53, 7, 0.02);
pub(super) const MODE: Field = Field::unsigned(0, 4, 1.0);
pub(super) const REASON: Field = Field::unsigned(4, 6, 1.0);
pub(super) const ACCEPTANCE: Field = Field::unsigned(10, 7, 0.01);
pub(super) const NORMALISED_SQUARE: Field = Field::unsigned(17, 10, 0.05);
pub(super) const DRIVE_FAULT: Field = Field::unsigned(27, 4, 1.0);
pub(super) const STEERING_FAULT: Field = Field::unsigned(31, 4, 1.0);
pub(super) const LASER: Field = Field::unsigned(35, 2, 1.0);
pub(super) const RESETS: Field = Field::unsigned(37, 8, 1.0);
pub(super) const LAST_RESET: Field = Field::unsigned(45, 8, 0.02);
pub(super) const START_SEARCH: Field = Field::unsigned(53, 3, 1.0);
pub(super) const POSE_IS_GOOD: Field = Field::unsigned(56, 1, 1.0);
pub(super) const CORRECTED: Field = Field::unsigned(57, 1, 1.0);
pub(super) const OVERFLOWS: Field = Field::unsigned(58, 2, 1.0);
pub(super) const PROTECTION_POSITION: Field = Field::unsigned(0, 14, 0.001);
pub(super) const PROTECTION_HEADING: Field = Field::unsigned(14, 13, 0.00025);
pub(super) const LIMIT_POSITION: Field = Field::unsigned(27, 10, 0.001);
pub(super) const LIMIT_HEADING: Field = Field::unsigned(37, 10, 0.00025);
pub(super) const ALARM: Field = Field::unsigned(47, 3, 1.0);
pub(super) const INITIAL_POSITION_DEVIATION: Field = Field::unsigned(24, 16, 1e-3);
pub(super) const INITIAL_HEADING_DEVIATION: Field = Field::unsigned(40, 16, 1e-4);
pub(super) const STANDSTILL: Field = Field::unsigned(20, 1, 1.0);

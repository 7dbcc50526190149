//! Numbers in the frames of other makers.

/// Which byte of a number comes first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ByteOrder {
    /// The lowest (Intel).
    LittleEndian,
    /// The highest (Motorola).
    BigEndian,
}

/// A number in whole bytes: `value = raw * scale + offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Signal {
    /// Where the number begins, bytes.
    pub first_byte: u8,
    /// How many bytes it has, 1 to 8.
    pub length: u8,
    /// Which byte comes first.
    pub order: ByteOrder,
    /// Whether it is in two's complement.
    pub is_signed: bool,
    /// Value of one step.
    pub scale: f64,
    /// Value of zero.
    pub offset: f64,
}

impl Signal {
    /// The number as it stands in the data. None if the data are too short for it.
    #[must_use]
    pub fn raw(&self, data: &[u8]) -> Option<i64> {
        let first = usize::from(self.first_byte);
        let bytes = data.get(first..first + usize::from(self.length))?;
        if bytes.is_empty() || bytes.len() > 8 {
            return None;
        }
        let join = |number: u64, byte: &u8| number << 8 | u64::from(*byte);
        let number = match self.order {
            ByteOrder::LittleEndian => bytes.iter().rev().fold(0, join),
            ByteOrder::BigEndian => bytes.iter().fold(0, join),
        };
        let unused = 64 - 8 * bytes.len() as u32;
        // Shifting up and down again copies the sign.
        Some(if self.is_signed { ((number << unused) as i64) >> unused } else { number as i64 })
    }

    /// The value. None if the data are too short for it.
    #[must_use]
    pub fn value(&self, data: &[u8]) -> Option<f64> {
        let raw = self.raw(data)?;
        let number = if self.is_signed { raw as f64 } else { raw as u64 as f64 };
        Some(number * self.scale + self.offset)
    }

    /// Puts the value into the data, as nearly as its steps tell it; the largest or least that they can if it is beyond.
    /// None if it has no place there.
    pub fn put(&self, value: f64, data: &mut [u8]) -> Option<()> {
        let length = usize::from(self.length);
        let first = usize::from(self.first_byte);
        let bytes = data.get_mut(first..first + length)?;
        if bytes.is_empty() || bytes.len() > 8 {
            return None;
        }
        let bits = 8 * u32::from(self.length);
        // As many as a number of 64 bits holds without rounding up.
        let most = if self.is_signed { i64::MAX >> (64 - bits) } else { (u64::MAX >> (64 - bits).max(1)) as i64 };
        let least = if self.is_signed { -most } else { 0 };
        let steps = libm::round((value - self.offset) / self.scale) as i64;
        let number = steps.clamp(least, most).to_le_bytes();
        let places = number.iter().take(length);
        match self.order {
            ByteOrder::LittleEndian => bytes.iter_mut().zip(places).for_each(|(to, from)| *to = *from),
            ByteOrder::BigEndian => bytes.iter_mut().rev().zip(places).for_each(|(to, from)| *to = *from),
        }
        Some(())
    }
}

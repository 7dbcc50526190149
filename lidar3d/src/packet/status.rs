//! The six bytes behind the blocks, in two dialects.

/// Packets in which an HDL-64E S2 or S3 sends all of its status once.
pub const STATUS_CYCLE: usize = 4160;

/// Which returns of a firing are sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReturnMode {
    /// The strongest one.
    Strongest,
    /// The last one.
    Last,
    /// The last and the strongest one; if they are the same, the second strongest.
    Dual,
}

impl ReturnMode {
    /// Name, for people.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Strongest => "strongest",
            Self::Last => "last",
            Self::Dual => "last and strongest",
        }
    }
}

/// The six bytes behind the blocks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tail(pub [u8; 6]);

impl Tail {
    /// No sensor's: all returns of a firing are of the very angle that is stated, as in packets made of range images.
    pub const AT_ONCE: Self = Self([0, 0, b'o', b'n', b'c', b'e']);

    /// In the early dialect: number of turns, and four characters of text.
    #[must_use]
    pub fn early(self) -> Option<(u16, [u8; 4])> {
        let [low, high, text @ ..] = self.0;
        text.iter()
            .all(|byte| byte.is_ascii_graphic() || *byte == b' ')
            .then_some((u16::from_le_bytes([low, high]), text))
    }

    /// In the later dialect: time past the hour, microseconds; a time of an hour or more is none.
    #[must_use]
    pub fn micros(self) -> Option<u32> {
        let [a, b, c, d, ..] = self.0;
        Some(u32::from_le_bytes([a, b, c, d])).filter(|micros| *micros < 3_600_000_000)
    }

    /// In the later dialect: type and value of a status byte. All but the HDL-64E state return mode and model here.
    #[must_use]
    pub fn status(self) -> (u8, u8) {
        (self.0[4], self.0[5])
    }

    /// The returns that are sent; None for an HDL-64E, which does not state them.
    #[must_use]
    pub fn return_mode(self) -> Option<ReturnMode> {
        let is_model = matches!(self.0[5], 0x21..=0x24 | 0x28 | 0xA1);
        match self.0[4] {
            0x37 if is_model => Some(ReturnMode::Strongest),
            0x38 if is_model => Some(ReturnMode::Last),
            0x39 if is_model => Some(ReturnMode::Dual),
            _ => None,
        }
    }
}

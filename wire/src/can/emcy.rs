//! Emergency messages (CiA 301, 7.2.7).

/// What a node reports of an error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Emergency {
    /// Error code; its high byte is the class, 0 is none.
    pub code: u16,
    /// The error register, object 1001h: bit 0 generic, 1 current, 2 voltage, 3 temperature, 4 communication,
    /// 5 device profile, 7 manufacturer.
    pub register: u8,
    /// What the manufacturer adds.
    pub details: [u8; 5],
}

impl Emergency {
    /// Whether the message says that an error is over (class 00h).
    #[must_use]
    pub const fn is_reset(&self) -> bool {
        self.code >> 8 == 0
    }

    /// The emergency in the eight bytes of a frame.
    #[must_use]
    pub const fn decode(bytes: [u8; 8]) -> Self {
        let [low, high, register, details @ ..] = bytes;
        Self { code: u16::from_le_bytes([low, high]), register, details }
    }

    /// The eight bytes of a frame.
    #[must_use]
    pub const fn encode(&self) -> [u8; 8] {
        let [low, high] = self.code.to_le_bytes();
        let [a, b, c, d, e] = self.details;
        [low, high, self.register, a, b, c, d, e]
    }
}

//! Where the gyro is connected.

/// Where the gyro is connected. The number of a place never gets another meaning.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum GyroConnection {
    /// To the CAN bus.
    Can = 0,
    /// To the I2C of the controller's board, at the address 68h.
    I2cLow = 1,
    /// To the I2C of the controller's board, at the address 69h.
    I2cHigh = 2,
}

impl GyroConnection {
    /// Their names, at their numbers.
    pub const NAMES: [&'static str; 3] = ["can", "i2c_68h", "i2c_69h"];

    /// The place with that number.
    #[must_use]
    pub const fn of_number(number: u64) -> Option<Self> {
        match number {
            0 => Some(Self::Can),
            1 => Some(Self::I2cLow),
            2 => Some(Self::I2cHigh),
            _ => None,
        }
    }
}

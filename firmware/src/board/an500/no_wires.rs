//! The emulated board has no I2C.

use core::convert::Infallible;

use embedded_hal::i2c::{ErrorType, I2c, Operation};

/// Wires that there are none of.
pub enum NoWires {}

impl ErrorType for NoWires {
    type Error = Infallible;
}

impl I2c for NoWires {
    fn transaction(&mut self, _address: u8, _operations: &mut [Operation<'_>]) -> Result<(), Infallible> {
        match *self {}
    }
}

//! I2C on the pins that the Arduino connector has for it (UM2407, table of that connector): SCL at D15, PB8, and SDA at D14, PB9.
//!
//! The board pulls neither up: what is connected must.

use embassy_stm32::i2c::{Config, Error, I2c, Master};
use embassy_stm32::mode::Blocking;
use embassy_stm32::peripherals::{I2C1, PB8, PB9};
use embassy_stm32::time::Hertz;
use embassy_stm32::{Peri, pac};
use embassy_time::Duration;
use embedded_hal::i2c::{ErrorType, Operation};

/// Fast mode (UM10204 of NXP, 5.2).
const CLOCK: Hertz = Hertz::khz(400);
/// Whoever holds the clock for longer does not work: ten times what a reading of a gyro takes, 9 bytes of 9 bits.
const PATIENCE: Duration = Duration::from_millis(2);

/// The controller and its pins.
pub struct I2cParts {
    pub controller: Peri<'static, I2C1>,
    pub clock: Peri<'static, PB8>,
    pub data: Peri<'static, PB9>,
}

impl I2cParts {
    /// Takes them.
    pub fn start(self) -> I2cWires {
        let mut config = Config::default();
        config.frequency = CLOCK;
        config.timeout = PATIENCE;
        I2cWires { wires: I2c::new_blocking(self.controller, self.clock, self.data, config) }
    }
}

/// The wires. What was begun and has failed is not gone on with.
pub struct I2cWires {
    wires: I2c<'static, Blocking, Master>,
}

impl ErrorType for I2cWires {
    type Error = Error;
}

impl embedded_hal::i2c::I2c for I2cWires {
    fn transaction(&mut self, address: u8, operations: &mut [Operation<'_>]) -> Result<(), Error> {
        let outcome = embedded_hal::i2c::I2c::transaction(&mut self.wires, address, operations);
        if outcome.is_err() {
            forget_what_was_begun();
        }
        outcome
    }
}

/// Resets the state of the controller, which lets go of the wires and keeps its settings (RM0433, 47.4.6 "Software reset").
fn forget_what_was_begun() {
    let control = pac::I2C1.cr1();
    control.modify(|control| control.set_pe(false));
    // It must be off for three cycles of its bus: each of these takes longer.
    for _ in 0..3 {
        let _ = control.read();
    }
    control.modify(|control| control.set_pe(true));
}

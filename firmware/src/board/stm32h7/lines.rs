//! Discrete lines of the boards: pins of the Arduino connector, and two of the board's LEDs (UM2407, tables of LEDs and of that connector).
//!
//! | line | pin | LED |
//! |---|---|---|
//! | pose valid | D9, PD15 | LD1, green, PB0: lit while it is valid |
//! | within docking limits | D10, PD14 | |
//! | fault | D12, PA6 | LD3, red, PB14: lit while something is wrong |
//! | standstill | D0, PG9 | |
//! | reset | D1, PG14 | |
//!
//! The inputs are pulled down. After a reset, and so behind a panic, no pin is driven: what is connected must pull down, too.

use core::convert::Infallible;

use agv_controller::LineSet;
use embassy_stm32::Peri;
use embassy_stm32::gpio::{Input, Level, Output, Pull, Speed};
use embassy_stm32::peripherals::{PA6, PB0, PB14, PD14, PD15, PG9, PG14};
use embedded_hal::digital::{ErrorType, OutputPin};

/// An output, and the LED that shows it.
pub struct ShownOutput {
    pin: Output<'static>,
    led: Option<Led>,
}

struct Led {
    pin: Output<'static>,
    /// Whether it is lit while the output is high.
    shows_high: bool,
}

impl ShownOutput {
    fn set(&mut self, level: Level) {
        self.pin.set_level(level);
        if let Some(Led { pin, shows_high }) = &mut self.led {
            pin.set_level(Level::from((level == Level::High) == *shows_high));
        }
    }
}

impl ErrorType for ShownOutput {
    type Error = Infallible;
}

impl OutputPin for ShownOutput {
    fn set_low(&mut self) -> Result<(), Infallible> {
        self.set(Level::Low);
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        self.set(Level::High);
        Ok(())
    }
}

/// The pins.
pub struct LinePins {
    pub pose_valid: Peri<'static, PD15>,
    pub pose_valid_led: Peri<'static, PB0>,
    pub within_docking_limits: Peri<'static, PD14>,
    pub fault: Peri<'static, PA6>,
    pub fault_led: Peri<'static, PB14>,
    pub standstill: Peri<'static, PG9>,
    pub reset: Peri<'static, PG14>,
}

impl LinePins {
    /// Takes them: the outputs are low, which is safe.
    pub fn start(self) -> LineSet<ShownOutput, Input<'static>> {
        let led = |pin, shows_high| Led { pin, shows_high };
        let low = |pin, led| Some(ShownOutput { pin, led });
        LineSet {
            pose_valid: low(
                Output::new(self.pose_valid, Level::Low, Speed::Low),
                Some(led(Output::new(self.pose_valid_led, Level::Low, Speed::Low), true)),
            ),
            within_docking_limits: low(Output::new(self.within_docking_limits, Level::Low, Speed::Low), None),
            fault: low(
                Output::new(self.fault, Level::Low, Speed::Low),
                Some(led(Output::new(self.fault_led, Level::High, Speed::Low), false)),
            ),
            standstill: Some(Input::new(self.standstill, Pull::Down)),
            reset: Some(Input::new(self.reset, Pull::Down)),
        }
    }
}

//! A gyro of the machine's own, on a thread of its own: its bus may take its time.

mod configuration;

use std::time::Duration;

use agv_controller::{GyroChip, GyroChipError};
use agv_core::measurement::{GyroSample, Time};
use agv_settings::Settings;
use bmi160::interface::{ReadData, WriteData};

use super::exchange::{Exchange, Task};

pub use configuration::{GyroConfiguration, GyroOpenError};

/// How often it is asked for a reading: by so much the time of one may be late.
const STEP: Duration = Duration::from_millis(1);

/// A gyro of any kind.
pub trait GyroPort: Send {
    /// See [`GyroChip::poll`].
    ///
    /// # Errors
    /// Why it tells nothing.
    fn poll(&mut self, now: Time) -> Result<Option<GyroSample>, GyroChipError>;
}

impl<Interface, Fault> GyroPort for GyroChip<Interface>
where
    Interface: ReadData<Error = bmi160::Error<Fault>> + WriteData<Error = bmi160::Error<Fault>> + Send,
{
    fn poll(&mut self, now: Time) -> Result<Option<GyroSample>, GyroChipError> {
        Self::poll(self, now)
    }
}

/// What makes a gyro of settings.
pub type OpenGyro = Box<dyn FnOnce(&Settings) -> Box<dyn GyroPort> + Send>;

fn word(error: GyroChipError) -> String {
    match error {
        GyroChipError::Foreign(identity) => format!("{} but calls itself {identity:02X}h", error.text()),
        GyroChipError::Bus | GyroChipError::Silent => error.text().to_owned(),
    }
}

/// Reads it until everything ends. `note` is told of what persists, once, and of its end.
pub(super) fn run(mut gyro: Box<dyn GyroPort>, exchange: &Exchange, note: &(dyn Fn(&str) + Sync)) {
    // A chip on SPI may answer the first time as if it were on I2C.
    let (mut last, mut told) = (None, None);
    while !exchange.is_over() {
        exchange.check_in(Task::Gyro);
        match gyro.poll(exchange.now()) {
            Ok(None) => {}
            Ok(Some(sample)) => {
                if told.is_some() {
                    note("gyro: it tells its rate again");
                }
                (last, told) = (None, None);
                exchange.pass_gyro(sample);
            }
            Err(error) => {
                if last == Some(error) && told != Some(error) {
                    told = Some(error);
                    note(&format!("gyro: {}", word(error)));
                }
                last = Some(error);
            }
        }
        std::thread::sleep(STEP);
    }
}

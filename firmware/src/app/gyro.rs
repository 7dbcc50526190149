//! A gyro on the board's own wires. What it does not tell, the localiser says.
//!
//! Deadline: none. It blocks for the time of a reading, .3 ms at 400 kHz, and shares its executor with the network.

use agv_controller::GyroChip;
use agv_settings::{GyroConnection, Settings};
use embassy_time::{Duration, Ticker};
use embedded_hal::i2c::I2c;

use super::exchange::{self, now};

/// How often it is asked for a reading: by so much the time of one may be late.
const STEP: Duration = Duration::from_millis(1);

/// Reads it for ever.
pub async fn run(wires: impl I2c, settings: &Settings) -> ! {
    let is_high = settings.gyro_connection == GyroConnection::I2cHigh;
    let mut chip = GyroChip::on_i2c(wires, is_high, settings);
    let mut ticker = Ticker::every(STEP);
    let mut is_silent = false;
    loop {
        match chip.poll(now()) {
            Ok(None) => {}
            Ok(Some(sample)) => {
                exchange::pass_gyro(sample);
                is_silent = false;
            }
            Err(error) if !core::mem::replace(&mut is_silent, true) => {
                defmt::warn!("gyro: {}", error.text());
            }
            Err(_) => {}
        }
        ticker.next().await;
    }
}
